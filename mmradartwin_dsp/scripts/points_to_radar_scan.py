#!/usr/bin/env python3
"""Sends the points of radar/points on as radar_msgs/RadarScan, on radar/scan, while somebody listens there."""
import argparse
import math
import sys

import rospy
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2

FIELDS = ("range_m", "azimuth_deg", "radial_speed_m_s", "power_db")


def radar_messages():
    """The package radar_msgs, which Debian does not have."""
    try:
        import radar_msgs.msg
    except ImportError as error:
        sys.exit(f"error: radar_msgs is not installed ({error}): build github.com/ros-perception/radar_msgs, release 0.1.0, "
                 "in a catkin workspace and source that, or on Ubuntu install ros-noetic-radar-msgs")
    return radar_msgs.msg


def radar_scan(messages, cloud):
    """RadarScan of a cloud with FIELDS. Azimuth [rad] is positive to the left (REP 103), the speed [m/s] where the range
    grows, NaN where no frame told it; the amplitude is the level [dBFS]. Raises ValueError where a field is missing."""
    missing = [name for name in FIELDS if name not in [field.name for field in cloud.fields]]
    if missing:
        raise ValueError(f"points have no field {', '.join(missing)}")
    scan = messages.RadarScan(header=cloud.header)
    for range_m, azimuth_deg, speed_m_s, power_db in point_cloud2.read_points(cloud, FIELDS):
        scan.returns.append(messages.RadarReturn(range=range_m, azimuth=math.radians(azimuth_deg), elevation=0.0,
                                                 doppler_velocity=speed_m_s, amplitude=power_db))
    return scan


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.parse_args(rospy.myargv(sys.argv)[1:])
    messages = radar_messages()
    rospy.init_node("points_to_radar_scan")
    scans = rospy.Publisher("radar/scan", messages.RadarScan, queue_size=10)

    def convert(cloud):
        if scans.get_num_connections() == 0:
            return
        try:
            scans.publish(radar_scan(messages, cloud))
        except ValueError as error:
            rospy.logwarn_throttle(5, f"radar/points: {error}")

    rospy.Subscriber("radar/points", PointCloud2, convert, queue_size=10)
    rospy.spin()


if __name__ == "__main__":
    main()

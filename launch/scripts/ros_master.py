"""Looks for the ROS master, which rosbag's programs wait for without end."""
import http.client
import os
import socket
import sys
import time
import xml.parsers.expat
import xmlrpc.client
from urllib.parse import urlsplit

WITHIN_S = 10
CALL_WITHIN_S = 3  # of what takes a connection and never answers


def address():
    """ROS_MASTER_URI, or what __master:= among the arguments says."""
    given = [word.split(":=", 1)[1] for word in sys.argv if word.startswith("__master:=")]
    return given[-1] if given else os.environ.get("ROS_MASTER_URI", "")


def problem():
    """Why no master can be asked, as a sentence; None once one has answered."""
    uri = address()
    try:
        parts = urlsplit(uri)
        usable = parts.scheme == "http" and parts.hostname and parts.port
    except ValueError:
        usable = False
    if not usable:
        return f"ROS_MASTER_URI: '{uri}' is no address of a ROS master; it must be as http://localhost:11311"
    before, until = socket.getdefaulttimeout(), time.monotonic() + WITHIN_S
    socket.setdefaulttimeout(CALL_WITHIN_S)
    try:
        while time.monotonic() < until:
            try:
                xmlrpc.client.ServerProxy(uri).getPid("/ros_master")
                return None
            except (OSError, xmlrpc.client.Error, http.client.HTTPException, xml.parsers.expat.ExpatError):
                time.sleep(0.2)
    finally:
        socket.setdefaulttimeout(before)
    return f"no ROS master answers at {uri}: start a launch file or roscore first, or set ROS_MASTER_URI"

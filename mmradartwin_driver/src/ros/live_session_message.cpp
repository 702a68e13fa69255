#include "mmradartwin_driver/ros/live_session_message.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "mmradartwin_dsp/csv_reader.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_dsp/sha256.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// Rows of the played poses, in the order of `poses`, with their new stamps; other columns are unchanged.
std::string restamp(const StoredFile& csv, const std::vector<LivePose>& poses) {
  CsvReader reader(csv.bytes, csv.name);
  const std::vector<std::string>& columns = reader.columns();
  const auto stamp = static_cast<std::size_t>(std::find(columns.begin(), columns.end(), "stamp") - columns.begin());
  std::map<std::string, std::vector<std::string>> rows;
  while (reader.next()) rows[reader.fields()[0]] = reader.fields();
  std::string out = join(columns, ",") + "\n";
  for (const LivePose& pose : poses) {
    std::vector<std::string> row = rows.at(pose.name);
    row.at(stamp) = formatStamp(pose.stamp_ns);
    out += join(row, ",") + "\n";
  }
  return out;
}

}  // namespace

mmradartwin_msgs::Session liveSessionMessage(const std::string& session, const std::vector<LivePose>& poses) {
  const fs::path file = fs::is_directory(session) ? fs::path(session) / "session.yaml" : fs::path(session);
  const std::string poses_reference = YamlMap::load(file.string()).text("poses");
  const fs::path poses_file = fs::weakly_canonical(resolvePath(poses_reference, file.string()));
  const std::string poses_name =
      poses_file.lexically_relative(fs::weakly_canonical(fs::absolute(file)).parent_path()).string();

  mmradartwin_msgs::Session message;
  message.name = fs::weakly_canonical(fs::absolute(file)).parent_path().filename().string();
  bool restamped = false;
  for (const StoredFile& stored : gatherSessionFiles(session)) {
    const bool of_poses = stored.name == poses_name;
    message.files.push_back(toMsg(of_poses ? StoredFile{stored.name, restamp(stored, poses)} : stored));
    restamped = restamped || of_poses;
  }
  if (!restamped) {
    throw InputError(file.string() + ": key poses: " + poses_reference +
                     " lies outside of the session: put it beside session.yaml to play the session");
  }
  for (const LivePose& pose : poses) message.capture_sha256.push_back(sha256OfFile(pose.capture));
  if (!poses.empty()) message.header.stamp = toRosTime(poses.front().stamp_ns);
  return message;
}

}  // namespace mmradartwin

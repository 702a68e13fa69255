#include "mmradartwin_driver/ros/live_session_message.h"

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_dsp/sha256.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

/// Rows of the played poses, in the order of `poses`, with their new stamps; other columns are unchanged.
std::string restamp(const std::string& csv, const std::vector<LivePose>& poses) {
  std::istringstream in(csv);
  std::string header;
  std::getline(in, header);
  std::map<std::string, std::string> rows;
  for (std::string line; std::getline(in, line);) rows[trimmed(line.substr(0, line.find(',')))] = line;
  std::string out = trimmed(header) + "\n";
  for (const LivePose& pose : poses) {
    const std::string row = trimmed(rows.at(pose.name));
    const std::size_t second = row.find(',', row.find(',') + 1);  // before the stamp
    const std::size_t third = row.find(',', second + 1);
    out += row.substr(0, second + 1) + formatStamp(pose.stamp_ns) + row.substr(third) + "\n";
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
    message.files.push_back(toMsg(of_poses ? StoredFile{stored.name, restamp(stored.bytes, poses)} : stored));
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

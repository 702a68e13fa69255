#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <rosbag/message_instance.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace mmradartwin {

/// The fields of a message type, by the text of its definition. ROS makes room for as many entries as a message's bytes
/// say before it looks whether so many follow: of a damaged bag, gigabytes.
class MessageLengths {
 public:
  MessageLengths(const std::string& type, const std::string& definition);
  /// False where a list or a text is longer than what is left of the bytes.
  bool hold(const std::uint8_t* bytes, std::size_t size) const;

 private:
  struct Field {
    std::string type;       ///< of one entry
    std::size_t bytes = 0;  ///< of one entry; 0: a message
    bool is_text = false, is_list = false;
    std::size_t count = 1;  ///< entries where it is no list
  };
  struct Rest {
    const std::uint8_t* at;
    std::size_t size;
    bool skip(std::size_t bytes);
    bool count(std::size_t& entries);
  };

  void addType(const std::string& name, const std::string& text);
  bool walk(const std::string& type, Rest& rest, int depth) const;
  bool walkField(const Field& field, Rest& rest, int depth) const;

  std::string type_;
  std::map<std::string, std::vector<Field>> types_;
};

/// Throws rosbag::BagFormatException for a message that does not hold what its lengths say.
void requireItsLengths(const rosbag::MessageInstance& message, const MessageLengths& lengths);

/// message.instantiate() that takes no more memory than the message has bytes for. Null where it is of another type.
template <typename Message>
boost::shared_ptr<Message> instanceOf(const rosbag::MessageInstance& message) {
  namespace traits = ros::message_traits;
  static const MessageLengths lengths(traits::datatype<Message>(), traits::definition<Message>());
  if (message.getMD5Sum() == traits::md5sum<Message>()) requireItsLengths(message, lengths);
  return message.instantiate<Message>();
}

}  // namespace mmradartwin

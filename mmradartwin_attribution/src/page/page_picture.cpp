#include "page/page_picture.h"

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <vector>

#include "mmradartwin_dsp/text.h"

namespace mmradartwin::page {

std::string base64(const std::vector<unsigned char>& bytes) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) { return i + k < bytes.size() ? static_cast<unsigned>(bytes[i + k]) : 0U; };
    const unsigned all = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : kDigits[all >> (18 - 6 * k) & 63];
  }
  return text;
}

std::string pictureHtml(const cv::Mat& picture, const std::string& alt) {
  std::vector<unsigned char> png;
  if (!cv::imencode(".png", picture, png, {cv::IMWRITE_PNG_COMPRESSION, 9})) {
    throw std::runtime_error("a picture of the report cannot be encoded");
  }
  return "<img width=\"" + std::to_string(picture.cols) + "\" height=\"" + std::to_string(picture.rows) + "\" alt=\"" +
         htmlEscape(alt) + "\" src=\"data:image/png;base64," + base64(png) + "\"/>";
}

}  // namespace mmradartwin::page

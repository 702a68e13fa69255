#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace mmradartwin::page {

/// An <img> that holds its picture itself, as a data URI. alt: what it shows, in words.
std::string pictureHtml(const cv::Mat& picture, const std::string& alt);

/// Base64 (RFC 4648) of bytes.
std::string base64(const std::vector<unsigned char>& bytes);

}  // namespace mmradartwin::page

// SPDX-License-Identifier: GPL-3.0-or-later
#include "text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

constexpr std::string_view kBlanks = " \t\v\f\r\n";

template <class Value>
std::errc parse(std::string_view word, Value& value) {
  // from_chars takes no leading +.
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end != word.data() + word.size() ? std::errc::invalid_argument : error;
}

}  // namespace

std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw IoError(fmt::format("{}: cannot be opened", file.string()));
  try {
    return {std::istreambuf_iterator<char>(stream), {}};
  } catch (const std::ios_base::failure&) {  // thrown by the buffer, of folders too
    throw IoError(fmt::format("{}: cannot be read to its end", file.string()));
  }
}

TextLines::TextLines(std::filesystem::path file, std::string bytes, Continuation continuation)
    : file_(std::move(file)), bytes_(std::move(bytes)), continuation_(continuation) {
  if (bytes_.starts_with("\xef\xbb\xbf")) end_ = 3;
  if (bytes_.starts_with("\xff\xfe") || bytes_.starts_with("\xfe\xff"))
    throw IoError(fmt::format("{}: is text in UTF-16; save it as UTF-8", file_.string()));
}

std::string_view TextLines::physical_line() {
  const std::size_t first = end_;
  const std::size_t last = std::min(bytes_.find_first_of("\r\n", first), bytes_.size());
  end_ = std::min(last + 1, bytes_.size());
  if (last + 1 < bytes_.size() && bytes_[last] == '\r' && bytes_[last + 1] == '\n') ++end_;
  ++following_;
  return std::string_view(bytes_).substr(first, last - first);
}

bool TextLines::next() {
  if (end_ >= bytes_.size()) return false;
  number_ = following_;
  text_ = physical_line();
  const auto line = trimmed(text_);
  // A comment may end with the name of a folder.
  if (continuation_ == Continuation::none || !line.ends_with('\\') || line.starts_with('#')) return true;
  joined_.clear();
  for (std::string_view part = text_;;) {
    part = trimmed(part);
    const bool goes_on = part.ends_with('\\');
    joined_ += part.substr(0, part.size() - (goes_on ? 1 : 0));
    if (!goes_on || end_ >= bytes_.size()) break;
    joined_ += ' ';
    part = physical_line();
  }
  text_ = joined_;
  return true;
}

bool TextLines::next_words() {
  while (next()) {
    words_.clear();
    for (std::size_t end = 0;;) {
      const auto first = text_.find_first_not_of(kBlanks, end);
      if (first == std::string_view::npos || text_[first] == '#') break;
      end = std::min(text_.find_first_of(kBlanks, first), text_.size());
      words_.push_back(text_.substr(first, end - first));
    }
    if (!words_.empty()) return true;
  }
  return false;
}

std::string TextLines::here() const {
  return fmt::format("{}:{}", file_.string(), number_);
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string_view after_first_word(std::string_view line) {
  line = trimmed(line);
  return trimmed(line.substr(std::min(line.find_first_of(kBlanks), line.size())));
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

std::string shown(std::string_view text) {
  constexpr std::size_t kMost = 60;
  std::string result(trimmed(text).substr(0, kMost));
  for (char& c : result)
    if (c < ' ' || c > '~') c = '?';
  return result;
}

std::optional<double> finite_number(std::string_view word) {
  double value = 0;
  std::errc error = parse(word, value);
  if (error == std::errc::result_out_of_range) {  // too large, or so small that it is 0
    long double wide = 0;
    error = parse(word, wide);
    value = static_cast<double>(wide);
  }
  if (error != std::errc() || !std::isfinite(value)) return {};
  return value;
}

std::optional<std::int64_t> whole_number(std::string_view word) {
  std::int64_t value = 0;
  if (parse(word, value) != std::errc()) return {};
  return value;
}

Vec3 coordinates(const TextLines& lines, std::size_t first, std::string_view object) {
  Vec3 x;
  for (std::size_t k = 0; k < 3; ++k) {
    if (first + k >= lines.words().size())
      throw InputError(fmt::format("{}: {} has {} coordinates, but needs three", lines.here(), object,
                                   lines.words().size() - std::min(first, lines.words().size())));
    const auto word = lines.words()[first + k];
    const auto value = finite_number(word);
    if (!value)
      throw InputError(
          fmt::format("{}: {}: coordinate '{}' is not a finite number", lines.here(), object, shown(word)));
    x[static_cast<Eigen::Index>(k)] = *value;
  }
  return x;
}

}  // namespace radiosity

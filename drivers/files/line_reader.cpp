#include "drivers/files/line_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

#include "core/printed.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/files/input_file.hpp"

namespace merkel {

Expected<LineReader, SetupError> LineReader::open(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return bad_input(path + " is a directory: use a file");
  }
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) {
    return bad_input("cannot read " + path + ": " + std::strerror(errno) +
                     (errno == ENOENT ? "; check the name" : ""));
  }
  ReadFiles::note(path);
  return LineReader(path, file);
}

LineReader::LineReader(std::string path, std::FILE* file)
    : path_(std::move(path)), file_(file), buffer_(std::size_t{1} << 16U) {}

std::string LineReader::where() const { return path_ + ":" + std::to_string(number_) + ": "; }

bool LineReader::refill() {
  std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
            buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
  end_ -= begin_;
  begin_ = 0;
  const std::size_t got = std::fread(buffer_.data() + end_, 1, buffer_.size() - end_, file_.get());
  end_ += got;
  if (got > 0) return true;
  if (std::ferror(file_.get()) != 0) error_ = path_ + " became unreadable: " + std::strerror(errno);
  at_end_ = true;
  return false;
}

LineReader::Outcome LineReader::next() {
  std::size_t searched = 0;
  for (;;) {
    const char* const first = buffer_.data() + begin_;
    const void* const found = std::memchr(first + searched, '\n', end_ - begin_ - searched);
    std::size_t length = end_ - begin_;
    if (found != nullptr) {
      length = static_cast<std::size_t>(static_cast<const char*>(found) - first);
    } else if (length <= kMaxLine && !at_end_) {
      searched = length;
      if (!refill() && !error_.empty()) return Outcome::kError;
      continue;
    } else if (length == 0) {
      return Outcome::kEnd;
    }

    ++number_;
    if (length > kMaxLine) {
      error_ = where() + "this line has more than " + std::to_string(kMaxLine) +
               " characters: is this a CSV table?";
      return Outcome::kError;
    }
    line_ = {first, length};
    begin_ += length + (found != nullptr ? 1 : 0);
    if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
    if (number_ == 1) line_ = without_byte_order_mark(line_);
    const auto binary = std::find_if(line_.begin(), line_.end(), [](char c) {
      return static_cast<unsigned char>(c) < 0x20 && c != '\t';
    });
    if (binary != line_.end()) {
      error_ = where() + "this line contains the control character " +
               printed("0x%02x", static_cast<unsigned char>(*binary)) + ": this is not a CSV table";
      return Outcome::kError;
    }
    return Outcome::kLine;
  }
}

Expected<void, SetupError> read_rows(const std::string& path,
                                     const std::function<const char*(std::string_view row)>& take) {
  auto lines = LineReader::open(path);
  if (!lines) return Unexpected<SetupError>(lines.error());
  LineReader::Outcome outcome = LineReader::Outcome::kEnd;
  while ((outcome = lines->next()) == LineReader::Outcome::kLine) {
    const std::string_view row = lines->line();
    if (row.empty() || row.starts_with('#')) continue;
    if (const char* const wrong = take(row)) return bad_input(lines->where() + wrong);
  }
  if (outcome == LineReader::Outcome::kError) return bad_input(lines->error());
  return {};
}

}  // namespace merkel

#include "drivers/files/npy_file.hpp"

#include <utility>

#include "drivers/files/raw_bytes.hpp"

namespace merkel {
namespace {

constexpr std::size_t kNpyHeaderBytes = 128;

/// Version 1.0: magic, length of the text, text padded with spaces and a line feed.
std::string header_of(std::string_view type, std::uint64_t values, std::size_t columns) {
  std::string header("\x93NUMPY\x01\x00", 8);
  header += static_cast<char>(kNpyHeaderBytes - 10);
  header += '\0';
  header += "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (";
  header += columns == 0 ? std::to_string(values) + ","
                         : std::to_string(values / columns) + ", " + std::to_string(columns);
  header += "), }";
  header.resize(kNpyHeaderBytes - 1, ' ');
  return header + '\n';
}

}  // namespace

Expected<NpyFile, SetupError> NpyFile::create(const std::string& path, std::string_view type,
                                              bool overwrite, std::size_t columns) {
  auto file = OutputFile::create(path, overwrite);
  if (!file) return Unexpected<SetupError>(file.error());
  if (!file->write(header_of(type, 0, columns)) || !file->flush()) {
    return unavailable(file->error());
  }
  file->end_header();
  return NpyFile(std::move(*file), type, columns);
}

NpyFile::NpyFile(OutputFile file, std::string_view type, std::size_t columns)
    : file_(std::move(file)),
      type_(type),
      columns_(columns),
      value_bytes_(static_cast<std::size_t>(type.back() - '0')) {}

void NpyFile::append(std::int64_t value) {
  buffer_.append(reinterpret_cast<const char*>(&value), value_bytes_);
}

void NpyFile::append(double value) { append_raw(buffer_, value); }

bool NpyFile::flush() {
  const std::uint64_t values = values_ + buffer_.size() / value_bytes_;
  if (!file_.write(std::exchange(buffer_, {})) || !file_.flush()) return false;
  if (values == values_) return true;
  if (!file_.rewrite(0, header_of(type_, values, columns_))) return false;
  values_ = values;
  return true;
}

bool NpyFile::close() { return flush() && file_.close(); }

}  // namespace merkel

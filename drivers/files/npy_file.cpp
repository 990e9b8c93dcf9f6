#include "drivers/files/npy_file.hpp"

#include <array>
#include <cstring>
#include <fstream>
#include <utility>

#include "drivers/files/input_file.hpp"
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

template <class Number>
std::vector<double> numbers_of(std::ifstream& file) {
  std::vector<double> values;
  Number number = 0;
  while (file.read(reinterpret_cast<char*>(&number), sizeof number)) {
    values.push_back(static_cast<double>(number));
  }
  return values;
}

}  // namespace

Expected<NpyValues, SetupError> read_npy(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 10> head{};
  if (!file.read(head.data(), head.size()) || std::memcmp(head.data(), "\x93NUMPY\x01", 7) != 0) {
    return bad_input("cannot read " + path + ": it is missing, or not a NumPy file");
  }
  ReadFiles::note(path);
  const std::size_t header_bytes =
      static_cast<unsigned char>(head[8]) + 256U * static_cast<unsigned char>(head[9]);
  std::string header(header_bytes, ' ');
  file.read(header.data(), static_cast<std::streamsize>(header_bytes));
  const auto is = [&header](const char* type) { return header.find(type) != std::string::npos; };
  if (is("'<f8'")) return NpyValues{.whole = false, .values = numbers_of<double>(file)};
  // Kilosort and SpikeInterface write unsigned times.
  if (is("'<i8'")) return NpyValues{.values = numbers_of<std::int64_t>(file)};
  if (is("'<u8'")) return NpyValues{.values = numbers_of<std::uint64_t>(file)};
  if (is("'<i4'")) return NpyValues{.values = numbers_of<std::int32_t>(file)};
  if (is("'<u4'")) return NpyValues{.values = numbers_of<std::uint32_t>(file)};
  if (is("'<i2'")) return NpyValues{.values = numbers_of<std::int16_t>(file)};
  return bad_input(path + " does not hold doubles, or whole numbers of 2, 4 or 8 bytes");
}

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

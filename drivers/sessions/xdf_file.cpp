#include "drivers/sessions/xdf_file.hpp"

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <vector>

#include <pugixml.hpp>
#include <sys/stat.h>

#include "drivers/files/input_file.hpp"
#include "drivers/sessions/byte_span.hpp"

namespace merkel {
namespace {

constexpr std::string_view kXdfMagic = "XDF:";

constexpr std::array<std::pair<std::string_view, std::uint64_t>, 7> kXdfFormats = {{{"int8", 1},
                                                                                    {"int16", 2},
                                                                                    {"int32", 4},
                                                                                    {"int64", 8},
                                                                                    {"float32", 4},
                                                                                    {"double64", 8},
                                                                                    {"string", 0}}};

/// False if it is not XML.
bool read_header(std::string_view text, XdfStream& stream) {
  pugi::xml_document document;
  if (!document.load_buffer(text.data(), text.size())) return false;
  const pugi::xml_node info = document.child("info");
  const double rate_Hz = info.child("nominal_srate").text().as_double();
  stream.header = text;
  stream.name = info.child_value("name");
  stream.format = info.child_value("channel_format");
  stream.period_s = rate_Hz > 0.0 ? 1.0 / rate_Hz : 0.0;
  for (const auto& [format, bytes] : kXdfFormats) {
    if (format != stream.format) continue;
    stream.form.value_bytes = bytes;
    stream.form.channels = info.child("channel_count").text().as_uint();
  }
  return true;
}

bool read_offset(ByteSpan bytes, ClockOffsets& offsets) {
  double time_s = 0.0;
  double offset_s = 0.0;
  if (!bytes.take(time_s) || !bytes.take(offset_s)) return false;
  offsets.emplace_back(time_s, offset_s);
  return std::isfinite(time_s) && std::isfinite(offset_s);
}

}  // namespace

Expected<XdfFile, SetupError> XdfFile::open(const std::string& path, std::uint64_t max_chunk) {
  std::unique_ptr<std::FILE, Close> opened(std::fopen(path.c_str(), "rb"));
  struct stat status {};
  if (!opened || ::fstat(::fileno(opened.get()), &status) != 0) {
    return bad_input("cannot read the session " + path + ": " + std::strerror(errno));
  }
  if (!S_ISREG(status.st_mode)) return bad_input(path + " is not a file: use a session (.xdf)");
  ReadFiles::note(path);
  XdfFile file(path, std::move(opened), static_cast<std::uint64_t>(status.st_size), max_chunk);
  std::array<char, kXdfMagic.size()> magic{};
  if (!file.read_bytes(magic.data(), magic.size()) ||
      std::string_view(magic.data(), magic.size()) != kXdfMagic) {
    return bad_input(path +
                     " is not a session or another XDF file (it does not start with \"XDF:\"); a "
                     "trace is played by merkel run --fast --probe replay:FILE");
  }
  return file;
}

void XdfFile::rewind() {
  place_ = kXdfMagic.size();
  truncated_ = ::fseeko(file_.get(), static_cast<off_t>(place_), SEEK_SET) != 0;
}

bool XdfFile::read_bytes(void* bytes, std::size_t count) {
  if (std::fread(bytes, 1, count, file_.get()) != count) return false;
  place_ += count;
  return true;
}

Unexpected<SetupError> XdfFile::damaged(const std::string& what) const {
  return bad_input("the session " + path_ + " is damaged at byte " + std::to_string(chunk_start_) +
                   ": " + what);
}

Expected<bool, SetupError> XdfFile::next(XdfChunk& chunk) {
  for (;;) {
    chunk_start_ = place_;
    if (truncated_ || place_ == size_) return false;
    std::uint8_t width = 0;
    std::uint64_t length = 0;
    if (!read_bytes(&width, 1)) return damaged("the file is unreadable");
    if (width != 1 && width != 4 && width != 8) return damaged("a chunk has an invalid length");
    std::uint16_t tag = 0;
    if (!read_bytes(&length, width) || length > size_ - place_) {
      truncated_ = true;  // the writer stopped within this chunk
      return false;
    }
    if (length < sizeof tag || !read_bytes(&tag, sizeof tag)) {
      return damaged("a chunk is too short");
    }
    const std::uint64_t rest = length - sizeof tag;
    if (length > max_chunk_) {
      if (::fseeko(file_.get(), static_cast<off_t>(rest), SEEK_CUR) != 0) {
        return damaged("the file is unreadable");
      }
      place_ += rest;
      continue;
    }
    chunk.tag = static_cast<XdfTag>(tag);
    chunk.content.resize(rest);
    if (!read_bytes(chunk.content.data(), rest)) {
      truncated_ = true;
      return false;
    }
    return true;
  }
}

Expected<std::map<std::uint32_t, XdfStream>, SetupError> read_xdf_streams(
    XdfFile& file,
    const std::function<void(std::uint32_t number, const XdfStream& stream, XdfRow row)>& take) {
  std::map<std::uint32_t, XdfStream> streams;
  XdfChunk chunk;
  file.rewind();
  for (;;) {
    const auto more = file.next(chunk);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) return streams;
    const bool header = chunk.tag == XdfTag::kStreamHeader;
    if (!header && chunk.tag != XdfTag::kSamples && chunk.tag != XdfTag::kClockOffset) continue;
    ByteSpan bytes(chunk.content);
    std::uint32_t number = 0;
    if (!bytes.take(number)) return file.damaged("a chunk has no stream");
    const std::string_view content = std::string_view(chunk.content).substr(sizeof number);
    if (header) {
      if (!read_header(content, streams[number] = {})) {
        return file.damaged("a stream's header is not XML");
      }
      continue;
    }
    const auto found = streams.find(number);
    if (found == streams.end()) return file.damaged("a stream has no header");
    XdfStream& stream = found->second;
    if (chunk.tag == XdfTag::kClockOffset) {
      if (!read_offset(bytes, stream.offsets)) {
        return file.damaged("an offset of clocks has an invalid value");
      }
    } else if (stream.form.channels > 0 &&
               !stream.for_each_sample(content, [&](XdfRow row) { take(number, stream, row); })) {
      return file.damaged("the samples of " + stream.name + " do not have the form of its header");
    }
  }
}

}  // namespace merkel

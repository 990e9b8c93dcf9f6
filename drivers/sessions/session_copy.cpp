#include "drivers/sessions/session_copy.hpp"

#include "core/parameters/parameter_error.hpp"
#include "drivers/sessions/session_headers.hpp"
#include "drivers/sessions/xdf_chunks.hpp"
#include "drivers/sessions/xdf_file.hpp"

namespace merkel {
namespace {

Expected<void, SetupError> copy_chunks(const std::string& path, OutputFile& copy,
                                       std::string_view name, const std::string& value,
                                       const std::function<bool(std::string_view)>& replaces) {
  auto session = XdfFile::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  XdfChunks chunks(copy);
  bool written = copy.write("XDF:");
  for (XdfChunk chunk; written;) {
    const auto more = session->next(chunk);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) break;
    if (chunk.tag == XdfTag::kFileHeader) {
      chunk.content = header_with_fact(chunk.content, name, value, replaces);
    }
    written = chunks.write(chunk.tag, chunk.content);
  }
  if (written && copy.close()) return {};
  return unavailable(copy.error());
}

}  // namespace

Expected<void, SetupError> copy_session(const std::string& path, OutputFile copy,
                                        std::string_view name, const std::string& value,
                                        const std::function<bool(std::string_view)>& replaces) {
  auto copied = copy_chunks(path, copy, name, value, replaces);
  if (!copied) copy.remove();
  return copied;
}

}  // namespace merkel

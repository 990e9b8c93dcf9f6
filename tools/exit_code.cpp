#include "tools/exit_code.hpp"

#include <cerrno>
#include <cstdio>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "drivers/printable_text.hpp"

namespace merkel {
namespace {

int complain(const std::string& sentence, int exit_code) {
  warn(sentence);
  return exit_code;
}

/// Whether standard output was closed by the caller, who wants none.
bool output_closed() {
  const int flags = ::fcntl(STDOUT_FILENO, F_GETFL);
  return flags == -1 || (flags & O_ACCMODE) == O_RDONLY;
}

/// Whether the reader of a pipe has gone, as `head` does: it has what it wanted.
bool reader_gone() {
  pollfd output{.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
  return ::poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

}  // namespace

int refuse(const std::string& sentence) { return complain(sentence, kWrongInput); }

int refuse(const SetupError& error) {
  return complain(error.sentence,
                  error.kind == SetupError::Kind::kUnavailable ? kRefused : kWrongInput);
}

int fail(const std::string& sentence) { return complain(sentence, kFailed); }

void warn(const std::string& sentence) {
  std::fflush(stdout);
  // Sentences quote files and devices, which may hold a terminal's control sequences.
  std::fprintf(stderr, "merkel: %s\n", printable_lines(shortened(sentence)).c_str());
}

int after_output(int exit_code) {
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  const int reason = errno;
  if ((flushed && std::ferror(stdout) == 0) || output_closed()) return exit_code;
  if (!reader_gone()) {
    warn("standard output could not be written" +
         (reason != 0 ? ": " + std::generic_category().message(reason) : std::string()) +
         "; what was printed is not complete: free space or write elsewhere, then run it again");
  }
  return exit_code == kDone ? kFailed : exit_code;
}

}  // namespace merkel

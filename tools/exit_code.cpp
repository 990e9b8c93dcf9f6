#include "tools/exit_code.hpp"

#include <cstdio>

#include "drivers/printable_text.hpp"

namespace merkel {
namespace {

/// Sentences quote files and devices, which may hold a terminal's control sequences.
int complain(const std::string& sentence, int exit_code) {
  std::fflush(stdout);
  std::fprintf(stderr, "merkel: %s\n", printable_lines(sentence).c_str());
  return exit_code;
}

}  // namespace

int refuse(const std::string& sentence) { return complain(sentence, kWrongInput); }

int refuse(const SetupError& error) {
  return complain(error.sentence,
                  error.kind == SetupError::Kind::kUnavailable ? kRefused : kWrongInput);
}

int fail(const std::string& sentence) { return complain(sentence, kFailed); }

}  // namespace merkel

#include "tools/commands/command.hpp"

#include <cstdio>

namespace merkel {
namespace {

int complain(const std::string& sentence, int exit_code) {
  std::fflush(stdout);
  std::fprintf(stderr, "merkel: %s\n", sentence.c_str());
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

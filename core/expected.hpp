#pragma once

#include <string>
#include <utility>

#include <tl/expected.hpp>

namespace merkel {

/// A value, or the error that prevented it.
template <class T, class E>
using Expected = tl::expected<T, E>;

template <class E>
using Unexpected = tl::unexpected<E>;

/// Why a set-up step (open, load, create) failed.
struct SetupError {
  enum class Kind {
    kBadInput,     ///< the user's input is wrong: a file, a key, a value, a URI
    kUnavailable,  ///< the input is valid, but the host refused: a path, a device, a right
  };
  Kind kind = Kind::kBadInput;
  std::string sentence;  ///< message for the user: what is wrong and what to do
};

/// A bad-input error to return from a function whose result is Expected<…, SetupError>.
[[nodiscard]] inline Unexpected<SetupError> bad_input(std::string sentence) {
  return Unexpected<SetupError>(
      SetupError{.kind = SetupError::Kind::kBadInput, .sentence = std::move(sentence)});
}

/// An unavailable error to return from a function whose result is Expected<…, SetupError>.
[[nodiscard]] inline Unexpected<SetupError> unavailable(std::string sentence) {
  return Unexpected<SetupError>(
      SetupError{.kind = SetupError::Kind::kUnavailable, .sentence = std::move(sentence)});
}

}  // namespace merkel

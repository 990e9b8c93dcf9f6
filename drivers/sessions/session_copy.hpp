#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "core/expected.hpp"
#include "drivers/files/output_file.hpp"

namespace merkel {

/// Copies a recorded session chunk by chunk, in bounded memory, with another fact: its streams stay
/// as they are. A copy of a session that broke off ends with its last whole chunk. After an error
/// the new file does not exist. Chunks longer than any of a session are left out.
/// \param replaces  true for the value of a fact of that name that the new one replaces
[[nodiscard]] Expected<void, SetupError> copy_session(
    const std::string& path, OutputFile copy, std::string_view name, const std::string& value,
    const std::function<bool(std::string_view)>& replaces);

}  // namespace merkel

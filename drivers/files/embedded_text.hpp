#pragma once

#include <span>
#include <string_view>

namespace merkel {

/// A file of the sources that is a part of the program. Who uses a list of them declares it; the
/// lists are made by merkel_embed() in embed_texts.cmake.
struct EmbeddedText {
  std::string_view name;  ///< of the file, without its folder
  std::string_view text;
};

}  // namespace merkel

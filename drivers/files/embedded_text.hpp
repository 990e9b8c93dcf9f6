#pragma once

#include <span>
#include <string_view>

namespace merkel {

/// A file of the sources that is a part of the program (merkel_embed() in embed_texts.cmake).
struct EmbeddedText {
  std::string_view name;  ///< of the file, without its folder
  std::string_view text;
};

extern const std::span<const EmbeddedText> kPageFiles;  ///< of the live page

}  // namespace merkel

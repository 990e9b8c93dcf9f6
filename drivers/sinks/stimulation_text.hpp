#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/expected.hpp"
#include "core/records/sent_command.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Sent stimulation commands as text. Numbers are the shortest decimals that read back as the same
/// doubles. Real-time: no.
class StimulationText {
 public:
  explicit StimulationText(const EncodingParameters& encoding);

  /// The columns of append_row(): those of the command, the electrode by its name, then when it
  /// passed the gate and until when it is valid.
  [[nodiscard]] static std::string csv_header();
  /// The same as older versions wrote it, without these two.
  [[nodiscard]] static std::string older_csv_header();
  /// `0.120000000,E12,update,35.5,80,12,,81624000,81724000`; the seventh field gives the reason if
  /// everything is off.
  void append_row(std::string& text, const SentCommand& sent) const;
  /// `"kind":"update","electrode":"E12",…`: the members of a JSON object, without its braces.
  void append_members(std::string& text, const SentCommand& sent) const;
  /// The name of its electrode; "unknown" if the scene of a damaged session has no such electrode.
  [[nodiscard]] const std::string& name(const StimulationCommand& command) const {
    return names_[index_of(command)];
  }
  [[nodiscard]] std::size_t electrodes() const noexcept { return names_.size() - 1; }

 private:
  [[nodiscard]] std::size_t index_of(const StimulationCommand& command) const {
    return std::min<std::size_t>(command.electrode, electrodes());
  }

  std::vector<std::string> names_;      ///< by electrode, and the unknown one's
  std::vector<std::string> phases_us_;  ///< the same
};

/// `"electrodes":[{"name":"E12",…}],"update_ms":10,…`: the electrodes and limits of a scene as the
/// members of a JSON object, without its braces. Real-time: no.
[[nodiscard]] std::string encoding_members(const EncodingParameters& encoding);

/// Fails if the scene has no electrodes.
[[nodiscard]] Expected<void, SetupError> require_electrodes(const Uri& uri,
                                                            const EncodingParameters& encoding);

}  // namespace merkel

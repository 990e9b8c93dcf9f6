#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/printable_text.hpp"
#include "drivers/sinks/export_sink.hpp"
#include "drivers/sinks/nwb_file.hpp"

namespace merkel {
namespace {

/// What NWB and DANDI want to know of an experiment: `experimenter` and `keywords` (lists,
/// separated by ";"), what it is about, the place, and the subject.
constexpr std::array<std::string_view, 9> kNwbFacts = {"experiment_description",
                                                       "experimenter",
                                                       "institution",
                                                       "lab",
                                                       "keywords",
                                                       "subject_id",
                                                       "species",
                                                       "sex",
                                                       "age"};

}  // namespace

OpenedSink open_nwb_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const TimeBase zero = TimeBase::read(options, setup);
  NwbContent content{.run = setup.run, .afferents = afferents_of(setup), .general = {}};
  for (const std::string_view name : kNwbFacts) {
    if (std::string value = options.text(name, ""); !value.empty()) {
      content.general.emplace_back(name, printable_text(value));
    }
  }
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  return ExportSink::open(uri, setup, zero,
                          [path = uri.path, content = std::move(content),
                           overwrite = setup.overwrite](RunJournal& journal, const TimeBase& time) {
                            return write_nwb(path, content, time, journal, overwrite);
                          });
}

}  // namespace merkel

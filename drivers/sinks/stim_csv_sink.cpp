#include "drivers/sinks/stimulation_text.hpp"
#include "drivers/sinks/text_sink.hpp"

namespace merkel {

OpenedSink open_stim_csv_sink(const Uri& uri, const SinkSetup& setup) {
  if (auto some = require_electrodes(uri, setup.run.encoding); !some) {
    return Unexpected<SetupError>(some.error());
  }
  const auto append = [text = StimulationText(setup.run.encoding)](
                          std::string& lines, const RecordBatch& batch, const TimeBase& time) {
    for (SentCommand sent : batch.sent) {
      sent.command.time = time(sent.command.time);
      text.append_row(lines, sent);
    }
    return std::size_t{0};
  };
  return open_text_sink(uri, setup,
                        {.head = StimulationText::csv_header() + "\n",
                         .kinds = kKinds<SentCommand>,
                         .at_once = true,
                         .append = append});
}

}  // namespace merkel

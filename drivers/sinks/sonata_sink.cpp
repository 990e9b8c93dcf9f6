#include <memory>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "drivers/files/csv_text.hpp"
#include "drivers/sinks/afferent_json.hpp"
#include "drivers/sinks/rows_sink.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/sonata_file.hpp"

namespace merkel {

// The description of a run at the head of its rows, as JSON.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SonataContent, population, afferents)

namespace {

/// Spikes as rows `time_ms,node_id`; nodes count from 0.
class SonataSink final : public RowsSink {
 public:
  SonataSink(std::string uri, std::string population, OutputFile rows, TimeBase time,
             const SinkSetup& setup)
      : RowsSink(std::move(uri), std::move(rows), time, setup.overwrite, "all spikes are"),
        content_{.population = std::move(population),
                 .rows = this->rows(),
                 .afferents = afferents_of(setup)} {}

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (auto started = begin({}); !started) return started;
    text_.clear();
    for (const SpikeEvent& spike : batch.spikes) {
      append_milliseconds(text_, time()(spike.time));
      text_ += ',' + std::to_string(spike.neuron - 1) + '\n';
    }
    return write_rows(text_, batch.spikes.size());
  }

 private:
  [[nodiscard]] std::string head(const RunOrigin& /*origin*/) override {
    return content_lines(content_) + "time_ms,node_id\n";
  }
  [[nodiscard]] Expected<void, std::string> convert(const std::string& path,
                                                    bool overwrite) override {
    return write_sonata(path, content_, overwrite);
  }

  SonataContent content_;
  std::string text_;
};

}  // namespace

void convert_recovered_sonata(const std::string& recovered, const SinkSetup& setup) {
  RowsSink::convert_recovered(recovered, "its spikes are", setup,
                              [&](const RowsSink::Recovered& run) {
                                auto content = run.content.get<SonataContent>();
                                content.rows = run.rows;
                                return write_sonata(recovered, content, false);
                              });
}

OpenedSink open_sonata_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const std::string population = options.text("population", "merkel");
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (population.empty() || population.find_first_of("/.") != std::string::npos) {
    return bad_input("\"" + uri.text + "\": the option population must be a name without / and .");
  }
  if (auto free = check_not_taken(node_types_name(uri.path), setup.overwrite); !free) {
    return Unexpected<SetupError>(free.error());
  }
  auto rows = RowsSink::open_rows(uri, setup);
  if (!rows) return Unexpected<SetupError>(rows.error());
  if (!rows->recovered().empty()) convert_recovered_sonata(rows->recovered(), setup);
  return std::make_unique<SonataSink>(uri.text, population, std::move(*rows), time, setup);
}

}  // namespace merkel

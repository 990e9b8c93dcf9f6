#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <sys/stat.h>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/file_rename.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sinks/afferent_table.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/sonata_file.hpp"
#include "drivers/sinks/time_base.hpp"

namespace merkel {
namespace {

/// Collects the spikes as rows of text in FILE.h5.part, which survives any crash, and converts it
/// to HDF5 at the end of the run. HDF5 does not guarantee that an unclosed file can be read, and it
/// cannot continue after a failed write.
class SonataSpikeSink final : public SpikeSink {
 public:
  SonataSpikeSink(std::string uri, std::string population, OutputFile rows, TimeBase time,
                  const SinkSetup& setup)
      : uri_(std::move(uri)),
        rows_(std::move(rows)),
        path_(rows_.path()),
        time_(time),
        content_{.population = std::move(population),
                 .rows = rows_.part(),
                 .afferents = afferents_of(setup)},
        overwrite_(setup.overwrite) {}

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }

  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    if (std::exchange(started_, true)) return {};
    time_.set(origin);
    std::string head;
    for (const auto& [name, value] : time_.facts()) head += "# " + name + "=" + value + "\n";
    const bool written = rows_.write(head + "time_ms,node_id\n");
    rows_.end_header();
    return settle(written);
  }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    if (auto started = begin({}); !started) return started;
    text_.clear();
    for (const SpikeEvent& spike : spikes) {
      append_milliseconds(text_, time_(spike.time));
      text_ += ',' + std::to_string(spike.neuron - 1) + '\n';
    }
    taken_ += spikes.size();
    return settle(rows_.write(text_));
  }

  [[nodiscard]] Expected<void, SinkError> flush() override { return settle(rows_.flush()); }

  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto started = begin({}); !started) return started;
    if (auto flushed = flush(); !flushed) return flushed;
    if (auto written = write_sonata(path_, content_, overwrite_); !written) {
      return Unexpected<SinkError>({.sentence = written.error() + "; all spikes are in " +
                                                rows_.part() +
                                                ", as text: free some space, and run again"});
    }
    rows_.remove();
    return {};
  }

  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  Expected<void, SinkError> settle(bool succeeded) {
    if (!succeeded) return Unexpected<SinkError>({.sentence = rows_.error()});
    if (rows_.settled()) delivered_ = taken_;
    return {};
  }

  std::string uri_;
  OutputFile rows_;
  std::string path_;
  TimeBase time_;
  SonataContent content_;
  bool overwrite_;
  bool started_ = false;
  std::string text_;
  std::uint64_t taken_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace

void convert_recovered_sonata(const Uri& uri, const std::string& recovered,
                              const SinkSetup& setup) {
  SonataContent content{.population = UriOptions(uri).text("population", "merkel"),
                        .rows = recovered + ".part",
                        .afferents = afferents_of(setup)};
  if (rename_without_replacing(recovered, content.rows) != 0) return;
  const auto written = write_sonata(recovered, content, false);
  if (written) {
    static_cast<void>(std::remove(content.rows.c_str()));
  } else if (setup.notice) {
    setup.notice(written.error() + "; its spikes are in " + content.rows + ", as text");
  }
}

OpenedSink open_sonata_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const std::string population = options.text("population", "merkel");
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (population.empty() || population.find_first_of("/.") != std::string::npos) {
    return bad_input("\"" + uri.text + "\": the option population must be a name without / and .");
  }
  struct stat status {};
  if (uri.path == "-" || (::stat(uri.path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) &&
                          !S_ISDIR(status.st_mode))) {
    return bad_input("\"" + uri.text + "\": HDF5 is written to regular files only");
  }
  auto rows = OutputFile::create(uri.path, setup.overwrite, setup.notice);
  if (!rows) return Unexpected<SetupError>(rows.error());
  if (!rows->recovered().empty()) {
    convert_recovered_sonata(uri, rows->recovered(), setup);
  }
  return std::make_unique<SonataSpikeSink>(uri.text, population, std::move(*rows), time, setup);
}

}  // namespace merkel

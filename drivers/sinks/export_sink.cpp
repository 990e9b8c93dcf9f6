#include "drivers/sinks/export_sink.hpp"

#include <chrono>
#include <cstdio>
#include <utility>

#include "drivers/files/output_file.hpp"
#include "drivers/sessions/session_reader.hpp"

namespace merkel {
namespace {

using std::chrono::steady_clock;

/// A longer export reports where it is.
constexpr std::chrono::seconds kReportEvery{3};

/// Reports the time of the run up to which a journal has been read.
class ReportedJournal final : public RunJournal {
 public:
  ReportedJournal(RunJournal& journal, std::string path,
                  const std::function<void(const std::string&)>& report)
      : journal_(journal), path_(std::move(path)), report_(report) {}

  [[nodiscard]] Expected<void, std::string> read(const Take& take) override {
    ++readings_;
    return journal_.read([&](const RecordBatch& batch) {
      if (report_ && steady_clock::now() >= next_) {
        next_ = steady_clock::now() + kReportEvery;
        report_("writing " + path_ + ": " + std::to_string(records_) + " records" +
                (readings_ > 1 ? ", reading " + std::to_string(readings_) : ""));
      }
      records_ += count_of(batch);
      return take(batch);
    });
  }
  [[nodiscard]] std::vector<Part> parts() override { return journal_.parts(); }

 private:
  RunJournal& journal_;
  std::string path_;
  const std::function<void(const std::string&)>& report_;
  int readings_ = 0;
  std::uint64_t records_ = 0;
  steady_clock::time_point next_ = steady_clock::now() + kReportEvery;
};

}  // namespace

Expected<void, std::string> SessionJournal::read(const Take& take) {
  const auto& path = path_.get();
  if (!path) return Unexpected<std::string>(path.error());
  auto session = SessionReader::open(*path);
  if (!session) return Unexpected<std::string>(session.error().sentence);
  const auto read =
      session->for_each([&](const SessionChunk& chunk) { return take(batch_of(chunk)); });
  if (!read) return Unexpected<std::string>(read.error().sentence);
  return {};
}

SinkSetup ExportSink::recovering(const Uri& uri, SinkSetup setup) {
  if (setup.notice) {
    setup.notice = [notice = setup.notice, scheme = uri.scheme](const std::string& line) {
      notice(line + "; merkel export SESSION --sink " + scheme + ":FILE makes a file from it");
    };
  }
  return setup;
}

ExportSink::ExportSink(const Uri& uri, const SinkSetup& setup, TimeBase time, Make make)
    : Sink(uri.text),
      path_(uri.path),
      make_(std::move(make)),
      journal_(setup.journal),
      progress_(setup.progress),
      time_(time) {}

OpenedSink ExportSink::open(const Uri& uri, const SinkSetup& setup, TimeBase time, Make make) {
  if (is_special_output(uri.path)) {
    return bad_input("\"" + uri.text + "\": this format can only be written to a regular file");
  }
  if (auto free = check_writable(uri.path, setup.overwrite); !free) {
    return Unexpected<SetupError>(free.error());
  }
  std::unique_ptr<ExportSink> sink(new ExportSink(uri, setup, time, std::move(make)));
  if (sink->journal_) return sink;
  Uri beside = uri;
  beside.scheme = "xdf";
  beside.path = journal_name(uri.path);
  beside.options.clear();
  set_aside(beside.path);  // of a run whose file could not be made
  SinkSetup own = recovering(uri, setup);
  own.overwrite = false;
  own.session = nullptr;
  auto session = open_xdf_sink(beside, own);
  if (!session) return session;
  sink->session_ = std::move(*session);
  return sink;
}

Expected<void, SinkError> ExportSink::begin(const RunOrigin& origin) {
  time_.set(origin);
  return session_ ? session_->begin(origin) : Expected<void, SinkError>();
}

Expected<void, SinkError> ExportSink::write(const RecordBatch& batch) {
  taken_ += batch.spikes.size();
  return session_ ? session_->write(batch) : Expected<void, SinkError>();
}

Expected<void, SinkError> ExportSink::flush() {
  return session_ ? session_->flush() : Expected<void, SinkError>();
}

Expected<void, SinkError> ExportSink::close() {
  const std::string beside = journal_name(path_);
  if (session_) {
    if (auto closed = session_->close(); !closed) return closed;
    journal_ = std::make_shared<SessionJournal>(beside);
  }
  ReportedJournal journal(*journal_, path_, progress_);
  if (const auto made = make_(journal, time_); !made) {
    return Unexpected<SinkError>(
        {.sentence = made.error() +
                     (session_ ? "; all of the run is in " + beside + ": merkel export " + beside +
                                     " --sink '" + uri_ + "' makes the file, when the cause is gone"
                               : "")});
  }
  if (session_) static_cast<void>(std::remove(beside.c_str()));
  delivered_ = taken_;
  return {};
}

}  // namespace merkel

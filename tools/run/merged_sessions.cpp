#include "tools/run/merged_sessions.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <queue>
#include <set>
#include <tuple>
#include <type_traits>
#include <utility>

#include <fmt/core.h>
#include <sys/resource.h>

#include "core/units.hpp"
#include "drivers/printable_text.hpp"
#include "tools/run/session_alignment.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;
using std::chrono::steady_clock;

/// So much of the merged time is sorted and handed on at once.
constexpr std::chrono::milliseconds kPortion{500};
/// Samples of a device may be older than the start of their run.
constexpr std::chrono::seconds kBeforeStart{10};
/// LabRecorder writes its streams one after the other, at most this far apart.
constexpr std::chrono::seconds kRecorderSlack{10};
constexpr std::chrono::seconds kReportEvery{3};

/// All sessions may be open at once.
void allow_open_files(std::size_t files) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= files) return;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, files);
  static_cast<void>(::setrlimit(RLIMIT_NOFILE, &limit));
}

/// Ticks are of one run, and so are its counters.
template <class Record>
inline constexpr bool kMerged =
    !std::is_same_v<Record, TickRecord> && !std::is_same_v<Record, RunStatus>;

/// The place of a record among those of the same time: by probe or electrode, which are numbered
/// through all sessions.
template <class Record>
std::uint32_t place_of(const Record& record) {
  if constexpr (requires { record.probe; }) return record.probe;
  if constexpr (requires { record.electrode; }) return record.electrode;
  if constexpr (requires { record.command; }) return record.command.electrode;
  return 0;
}

template <class Record>
bool before(const Record& a, const Record& b) {
  if constexpr (std::is_same_v<Record, SpikeEvent>) return a < b;
  return std::pair(time_of(a), place_of(a)) < std::pair(time_of(b), place_of(b));
}

/// Moves the records up to a time from one list to the end of another.
template <class Record>
void move_until(nanoseconds time, std::vector<Record>& from, std::vector<Record>& to) {
  const auto later = std::stable_partition(
      from.begin(), from.end(), [time](const Record& each) { return time_of(each) <= time; });
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(later));
  from.erase(from.begin(), later);
  if (from.empty()) from.shrink_to_fit();
}

}  // namespace

/// Adds the records of a chunk, as those of the merged run.
void MergedSessions::Merged::add(const SessionChunk& chunk, RecordLists<RecordVector>& to) const {
  for_each_kind(chunk, [&]<class Record>(const std::vector<Record>& list) {
    if constexpr (kMerged<Record>) {
      auto& merged = to.of<Record>();
      merged.reserve(merged.size() + list.size());
      for (const Record& record : list) renumber(merged.emplace_back(record));
    }
  });
}

template <class Record>
void MergedSessions::Merged::renumber(Record& record) const {
  const auto shift = [](auto& number, auto by) {
    number = static_cast<std::remove_reference_t<decltype(number)>>(number + by);
  };
  if constexpr (requires { record.probe; }) shift(record.probe, probes);
  if constexpr (requires { record.electrode; }) shift(record.electrode, electrodes);
  if constexpr (requires { record.command; }) shift(record.command.electrode, electrodes);
  if constexpr (requires { record.neuron; }) shift(record.neuron, neurons);
  if constexpr (requires { record.patch; }) shift(record.patch, patches);
  if constexpr (requires { record.label; }) record.label = rig + ": " + record.label;
  if constexpr (std::is_same_v<Record, LoopEvent>) {
    shift(record.subject, record.kind == LoopEvent::Kind::kNeuronReset ? neurons : probes);
  }
}

/// One reading of all sessions.
class MergedSessions::Reading {
 public:
  explicit Reading(MergedSessions& merged)
      : merged_(merged), open_(merged.sessions_.size()), waiting_(open_.size()) {
    for (std::size_t i = 0; i < open_.size(); ++i) {
      const Merged& part = merged.sessions_[i];
      next_.push({.until = part.session->origin().start - kBeforeStart, .session = i});
    }
  }

  Expected<void, std::string> run(const Take& take,
                                  const std::function<void(const std::string&)>& progress) {
    auto report = steady_clock::now() + kReportEvery;
    nanoseconds handed = nanoseconds::min();
    while (!next_.empty()) {
      const Turn turn = next_.top();
      next_.pop();
      if (handed == nanoseconds::min()) handed = turn.until;
      if (turn.until - handed >= kPortion) {
        handed = turn.until;
        if (!hand_on(handed, take)) return {};
      }
      if (auto read = read_chunk(turn); !read) return read;
      if (!progress || steady_clock::now() < report) continue;
      report = steady_clock::now() + kReportEvery;
      progress(fmt::format("merging: {} of {} sessions read, {:.0f} s of their time", ended_,
                           open_.size(), units::s_from(handed - merged_.origin().start)));
    }
    while (const auto first = earliest()) {
      if (!hand_on(*first + kPortion, take)) break;
    }
    return {};
  }

 private:
  /// The session that is read next is the one that is least far.
  struct Turn {
    nanoseconds until{0};  ///< its records up to here are read
    std::size_t session = 0;
    bool operator<(const Turn& other) const {
      return std::tie(until, session) > std::tie(other.until, other.session);
    }
  };
  struct Open {
    SessionReader reader;
    bool has_ticks = false;
  };

  Expected<void, std::string> read_chunk(Turn turn) {
    const Merged& part = merged_.sessions_[turn.session];
    auto& open = open_[turn.session];
    if (!open) {
      auto reader = part.session->reader();
      if (!reader) return Unexpected<std::string>(reader.error().sentence);
      open = std::make_unique<Open>(Open{std::move(*reader)});
    }
    const auto more = part.session->next(open->reader, chunk_);
    if (!more) return Unexpected<std::string>(more.error().sentence);
    if (!*more) {
      merged_.complete_ = merged_.complete_ && open->reader.complete();
      open.reset();
      ++ended_;
      return {};
    }
    // Whoever has the ticks of a time has the rest of it.
    if (!chunk_.ticks.empty()) {
      open->has_ticks = true;
      turn.until = std::max(turn.until, chunk_.ticks.back().time);
    } else if (!open->has_ticks) {
      for (const DeliveredSample& item : chunk_.samples) {
        turn.until = std::max(turn.until, item.sample.time - kRecorderSlack);
      }
    }
    part.add(chunk_, waiting_[turn.session]);
    next_.push(turn);
    return {};
  }

  /// The time of the earliest record that waits.
  [[nodiscard]] std::optional<nanoseconds> earliest() const {
    std::optional<nanoseconds> first;
    for (const RecordLists<RecordVector>& waiting : waiting_) {
      for_each_kind(waiting, [&]<class Record>(const std::vector<Record>& list) {
        if constexpr (kMerged<Record>) {
          for (const Record& each : list)
            first = std::min(first.value_or(time_of(each)), time_of(each));
        }
      });
    }
    return first;
  }

  bool hand_on(nanoseconds until, const Take& take) {
    RecordLists<RecordVector> due;
    for_each_kind(due, [&]<class Record>(std::vector<Record>& list) {
      if constexpr (kMerged<Record>) {
        for (auto& waiting : waiting_) move_until(until, waiting.template of<Record>(), list);
        std::stable_sort(list.begin(), list.end(), before<Record>);
      }
    });
    return count_of(due) == 0 || take(batch_of(due));
  }

  MergedSessions& merged_;
  std::vector<std::unique_ptr<Open>> open_;  ///< null before and after its turns
  std::priority_queue<Turn> next_;
  std::vector<RecordLists<RecordVector>> waiting_;  ///< of each session: read, on the merged clock
  SessionChunk chunk_;
  std::size_t ended_ = 0;
};

void MergedSessions::add(std::unique_ptr<RecordedSession> session, std::string rig,
                         const ClockMap& clock) {
  const RunDescription& own = session->run();
  if (sessions_.empty()) {
    run_.model = own.model;
    run_.model.patches.clear();
    run_.model.indenters.clear();
    run_.encoding = own.encoding;
    run_.encoding.electrodes.clear();
  }
  const auto patches = static_cast<std::uint16_t>(run_.model.patches.size());
  const auto electrodes = static_cast<std::uint16_t>(run_.encoding.electrodes.size());
  for (PatchParameters patch : own.model.patches) {
    patch.name = rig + (patch.name.empty() ? "" : "." + patch.name);
    run_.model.patches.push_back(std::move(patch));
  }
  for (Indenter indenter : own.model.indenters) {
    indenter.patch += patches;
    run_.model.indenters.push_back(std::move(indenter));
  }
  for (Electrode electrode : own.encoding.electrodes) {
    electrode.patch += patches;
    electrode.group.reset();  // its settings hold those of the group
    electrode.name = printable_column(rig + "." + electrode.name);
    const ElectrodeLimits limits = ElectrodeLimits::of(electrode, own.encoding.stimulation);
    electrode.phase = limits.phase;
    electrode.max_charge_nC = limits.max_charge_nC;
    electrode.max_amplitude_uA = limits.max_amplitude_uA;
    electrode.max_slope_uA_per_s = limits.max_slope_uA_per_s;
    run_.encoding.electrodes.push_back(std::move(electrode));
  }
  run_.probes.insert(run_.probes.end(), own.probes.begin(), own.probes.end());
  const nanoseconds start = session->origin().start;
  run_.facts.emplace_back("merged_session", session->path());
  run_.facts.emplace_back("merged_scene", own.scene);
  run_.facts.emplace_back("merged_offset_ns", std::to_string((clock(start) - start).count()));
  run_.facts.emplace_back("merged_rate_ppm", fmt::format("{:.6f}", clock.rate() * 1e6));
  run_.scene += (run_.scene.empty() ? "" : " + ") + rig;
  sessions_.push_back({.session = std::move(session),
                       .rig = std::move(rig),
                       .neurons = neurons_,
                       .probes = probes_,
                       .patches = patches,
                       .electrodes = electrodes});
  sessions_.back().session->set_clock(clock);
  neurons_ += sessions_.back().session->neurons();
  probes_ += static_cast<std::uint32_t>(sessions_.back().session->scene()->probes.size());
}

Expected<std::shared_ptr<MergedSessions>, SetupError> MergedSessions::open(
    const std::vector<std::string>& paths, const MergeSettings& settings) {
  std::shared_ptr<MergedSessions> merged(new MergedSessions);
  std::optional<SessionClock> first;
  std::set<std::string> rigs;
  auto report = steady_clock::now() + kReportEvery;
  for (const std::string& path : paths) {
    auto session = RecordedSession::open(path);
    if (!session) return Unexpected<SetupError>(session.error());
    if (!(*session)->scene()) {
      return bad_input(path +
                       " was recorded without a simulation: only sessions of merkel run "
                       "hold a scene");
    }
    const bool by_utc = settings.mark.empty() && !settings.pulses;
    auto known = SessionClock::read(**session, by_utc && first ? &*first : nullptr);
    if (!known) return Unexpected<SetupError>(known.error());
    const std::string own =
        known->rig.empty() ? std::filesystem::path(path).stem().string() : known->rig;
    std::string rig = own;
    for (int number = 2; !rigs.insert(rig).second; ++number) {
      rig = own + "_" + std::to_string(number);
    }
    ClockMap clock{nanoseconds{0}};
    if (first) {
      auto alignment = align(*first, *known, settings, clock);
      if (!alignment) return Unexpected<SetupError>(alignment.error());
      merged->alignments_.push_back(std::move(*alignment));
    } else {
      first = std::move(*known);
    }
    merged->add(std::move(*session), std::move(rig), clock);
    if (!settings.progress || steady_clock::now() < report) continue;
    report = steady_clock::now() + kReportEvery;
    settings.progress(
        fmt::format("aligning: {} of {} sessions", merged->sessions_.size(), paths.size()));
  }
  merged->progress_ = settings.progress;
  return merged;
}

Expected<void, std::string> MergedSessions::read(const Take& take) {
  allow_open_files(sessions_.size() + 64);
  complete_ = true;
  return Reading(*this).run(take, progress_);
}

std::vector<RunJournal::Part> MergedSessions::parts() {
  std::vector<RunJournal::Part> parts;
  for (const Merged& each : sessions_) {
    parts.push_back({.journal = *each.session,
                     .tick = each.session->run().model.tick,
                     .neurons = each.session->neurons(),
                     .probes = each.session->scene()->probes.size(),
                     .electrodes = each.session->run().encoding.electrodes.size()});
  }
  return parts;
}

}  // namespace merkel

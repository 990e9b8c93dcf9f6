#include "tools/run/session_replay.hpp"

#include <algorithm>
#include <utility>

#include "drivers/files/csv_text.hpp"

namespace merkel {
namespace {

std::string sentence_of(const SpikeEvent& spike) {
  std::string text = "neuron " + std::to_string(spike.neuron) + " at ";
  append_seconds(text, spike.time);
  text += " s";
  if (spike.flags != 0) text += " (flags " + std::to_string(spike.flags) + ")";
  return text;
}

}  // namespace

SessionReplay::SessionReplay(TactileModel& model, StimulationEncoder* encoder)
    : model_(model),
      spikes_("spike", "of", [](const SpikeEvent& spike) { return sentence_of(spike); }),
      step_(model, encoder),
      stimulation_(encoder),
      records_(model.indenters()) {
  for (const Indenter& indenter : model.parameters().indenters) {
    taxels_.emplace_back(indenter.taxels() != nullptr ? indenter.taxels()->size() : 0);
  }
}

void SessionReplay::differ(std::string sentence) {
  if (verdict_.difference.empty()) verdict_.difference = std::move(sentence);
}

/// Applies the blocks of a tick, which precede its record in the file. False if one is missing.
bool SessionReplay::take_taxels(const TickRecord& record) {
  std::vector<float>& taxels = taxels_[record.probe];
  if (taxels.empty()) return record.taxel_blocks == 0;
  std::uint16_t found = 0;
  for (auto block = blocks_.begin(); block != blocks_.end() && block->tick <= record.number;) {
    if (block->tick != record.number || block->probe != record.probe) {
      ++block;
      continue;
    }
    if (block->first + std::size_t{block->count} > taxels.size()) return false;
    std::copy_n(block->pressure_kPa.begin(), block->count, taxels.begin() + block->first);
    ++found;
    block = blocks_.erase(block);
  }
  model_.set_taxels(record.probe, taxels);
  return found == record.taxel_blocks;
}

bool SessionReplay::take_tick(const TickRecord& record) {
  const bool first_probe = probe_ == 0;
  const std::uint64_t expected = last_ ? last_->number + (first_probe ? 1 : 0) : 1;
  if (record.number != expected || record.probe != probe_ ||
      (last_ && (first_probe ? record.time <= last_->time : record.time != last_->time))) {
    if (!last_ && record.number > 1) {
      differ(
          "the recording starts at tick " + std::to_string(record.number) +
          " of a run: it can be played (--realtime) and exported, but not simulated again, because "
          "the state of its neurons at that tick is unknown");
      broken_ = true;
      return false;
    }
    differ("the record of tick " + std::to_string(expected) + ", probe " + std::to_string(probe_) +
           " is missing: the recorder's queue was full, or the file was changed");
    broken_ = true;
    return false;
  }
  if (!take_taxels(record)) {
    differ("the taxels of tick " + std::to_string(expected) + ", probe " + std::to_string(probe_) +
           " are missing: the recorder's queue was full, or the file was changed");
    broken_ = true;
    return false;
  }
  last_ = record;
  records_[probe_] = record;
  held_ = held_ || record.state == TickRecord::State::kHeld;
  verdict_.samples_late += record.late;
  probe_ = (probe_ + 1) % records_.size();
  return probe_ == 0;
}

void SessionReplay::take(const SessionChunk& chunk, const Callbacks& made) {
  stimulation_.take(chunk.commands, chunk.drives);
  blocks_.insert(blocks_.end(), chunk.taxels.begin(), chunk.taxels.end());
  if (verdict_.identical()) spikes_.expect(chunk.spikes);
  for (const LoopEvent& event : chunk.events) {
    if (event.kind == LoopEvent::Kind::kGap) ++verdict_.gaps;
    if (event.kind == LoopEvent::Kind::kRelease) ++verdict_.releases;
  }
  if (!chunk.status.empty()) verdict_.losses = chunk.status.back().losses;
  for (const TickRecord& record : chunk.ticks) {
    // After a lost record, the state of the membranes is unknown, so nothing can be simulated.
    if (broken_) return;
    if (!take_tick(record)) continue;
    ++verdict_.ticks;
    if (held_) ++verdict_.held_ticks;
    held_ = false;
    stimulation_.prepare(record.time);
    const SimulationStep::Output tick = step_.step(records_);
    spikes_.take(tick.spikes);
    differ(spikes_.difference());
    if (made.spikes) made.spikes(tick.spikes);
    stimulation_.compare(tick.commands, made.commands);
    if (made.ticks) made.ticks(records_);
  }
}

SessionReplay::Outcome SessionReplay::finish(const Callbacks& made) {
  if (!broken_) stimulation_.finish(made.commands);
  verdict_.spikes = spikes_.made();
  verdict_.commands = stimulation_.commands();
  differ(stimulation_.difference());
  // Spikes are recorded before the records of their tick. Spikes after the last whole tick cannot
  // be compared.
  if (!verdict_.identical()) return verdict_;
  const auto& recorded = spikes_.remaining();
  const auto beyond = std::find_if(recorded.begin(), recorded.end(), [this](const auto& spike) {
    return !last_ || probe_ != 0 || spike.time > last_->time;
  });
  verdict_.uncompared = static_cast<std::uint64_t>(recorded.end() - beyond);
  if (beyond != recorded.begin()) {
    spikes_.miss();
    differ(spikes_.difference());
  }
  return verdict_;
}

}  // namespace merkel

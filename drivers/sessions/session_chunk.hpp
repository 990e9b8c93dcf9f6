#pragma once

#include "core/records/record_batch.hpp"
#include "drivers/sessions/session_format.hpp"

namespace merkel {

/// The items of one chunk of a session, all of one kind.
struct SessionChunk : RecordLists<RecordVector> {
  SessionStream::Id stream = SessionStream::Id::kSpikes;
};

}  // namespace merkel

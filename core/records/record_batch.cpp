#include "core/records/record_batch.hpp"

namespace merkel {

RecordBatch batch_of(const RecordLists<RecordVector>& lists) {
  RecordBatch batch;
  for_each_kind(lists,
                [&]<class Record>(const std::vector<Record>& list) { batch.of<Record>() = list; });
  return batch;
}

}  // namespace merkel

#pragma once

#include <type_traits>

namespace merkel {

/// Data that may cross threads: trivially copyable, with no pointers to follow or memory to free.
template <class T>
concept PlainData = std::is_trivially_copyable_v<T>;

template <PlainData T>
class BoundedQueue;

}  // namespace merkel

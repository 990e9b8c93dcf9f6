#pragma once

/// Marks a function that the simulation thread may call: it does not allocate, lock, log, throw or
/// block. Clang 20 and later check this.
#if defined(__has_cpp_attribute)
#if __has_cpp_attribute(clang::nonblocking)
#define MERKEL_REALTIME [[clang::nonblocking]]
#endif
#endif
#ifndef MERKEL_REALTIME
#define MERKEL_REALTIME
#endif

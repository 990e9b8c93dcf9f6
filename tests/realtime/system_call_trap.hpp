#pragma once

namespace merkel {

/// Counts every system call of the calling thread from now on but absolute sleeps, whatever
/// function makes it: the kernel itself stops it (seccomp), a signal handler counts it and lets it
/// happen. For x86-64 Linux. \return false where the kernel or the processor has no such thing
bool trap_system_calls_of_this_thread();

/// Counting goes on, or pauses, for all threads so trapped.
void count_system_calls(bool counting);
/// How many were counted.
int system_calls_counted();
/// The number of the last one counted; −1 if none was.
int last_system_call();

}  // namespace merkel

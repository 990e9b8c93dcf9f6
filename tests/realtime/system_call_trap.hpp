#pragma once

namespace merkel {

/// From now on, counts every system call of the calling thread except absolute sleeps and
/// readings of its processor time, whatever function makes it. The kernel stops the call (seccomp);
/// a signal handler counts it and lets it proceed. For x86-64 Linux. \return false if the kernel or
/// the processor does not support this
bool trap_system_calls_of_this_thread();

/// Resumes or pauses counting for all trapped threads.
void count_system_calls(bool counting);
/// Number of system calls counted.
int system_calls_counted();
/// Number of the last system call counted; −1 if none.
int last_system_call();

}  // namespace merkel

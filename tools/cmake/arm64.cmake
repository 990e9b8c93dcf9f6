# Cross-building for 64-bit ARM with Debian's g++-aarch64-linux-gnu; tests run under qemu-aarch64
# (qemu-user). `.ci/arm64` unpacks the libraries of that machine into MERKEL_ARM64_ROOT.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES MERKEL_ARM64_ROOT)
set(MERKEL_ARM64_ROOT "" CACHE PATH "Folder with the unpacked Debian packages for arm64")
if(NOT MERKEL_ARM64_ROOT)
  message(FATAL_ERROR "Give -DMERKEL_ARM64_ROOT=FOLDER; `.ci/arm64` makes such a folder")
endif()
set(CMAKE_FIND_ROOT_PATH ${MERKEL_ARM64_ROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
# The libraries, and those behind them.
foreach(folder lib usr/lib)
  string(APPEND CMAKE_EXE_LINKER_FLAGS_INIT
    " -L${MERKEL_ARM64_ROOT}/${folder}/aarch64-linux-gnu -Wl,-rpath-link,${MERKEL_ARM64_ROOT}/${folder}/aarch64-linux-gnu")
endforeach()
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L ${MERKEL_ARM64_ROOT})

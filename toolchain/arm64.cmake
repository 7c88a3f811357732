# 64-bit ARM from an x86-64 Debian with g++-aarch64-linux-gnu, which looks for header-only libraries where the
# build machine keeps its own.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR}/arm64)
# Man pages are made of what the programs say.
set(CMAKE_CROSSCOMPILING_EMULATOR "qemu-aarch64-static;-L;/usr/aarch64-linux-gnu")

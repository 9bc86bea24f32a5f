// SPDX-License-Identifier: Apache-2.0
// Preloaded into a daemon, a disk that is slow or fails: before each pread() it looks into the file $SLOW_DISK, which says
// how many milliseconds a read takes and whether it fails: "100 0", "0 1". Made for bench/bars.py.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

static int breaks(void) {
  const char* name = getenv("SLOW_DISK");
  FILE* file = name ? fopen(name, "r") : NULL;
  long ms = 0;
  int fails = 0;
  if (file) {
    if (fscanf(file, "%ld %d", &ms, &fails) != 2) ms = fails = 0;
    fclose(file);
  }
  if (ms > 0) {
    struct timespec pause = {ms / 1000, ms % 1000 * 1000000};
    nanosleep(&pause, NULL);
  }
  return fails;
}

ssize_t pread64(int file, void* to, size_t bytes, off64_t at) {
  static ssize_t (*read_at)(int, void*, size_t, off64_t);
  if (!read_at) read_at = dlsym(RTLD_NEXT, "pread64");
  if (breaks()) {
    errno = EIO;
    return -1;
  }
  return read_at(file, to, bytes, at);
}

ssize_t pread(int file, void* to, size_t bytes, off_t at) { return pread64(file, to, bytes, at); }

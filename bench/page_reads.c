// SPDX-License-Identifier: Apache-2.0
// Reads pages of a file as those of a volume are read, and says how fast: with pread() on so many threads, each a run of
// the batch in the order of the file; the same, once the system was told of all of the batch (posix_fadvise, WILLNEED);
// or all of a batch through one io_uring. Made for bench/page_reads.py.
//
//   page_reads FILE PAGE_BYTES PAGES BATCH SEED HOW[:N]...   HOW: pread or told (on N threads), uring (N at a time)
//
// Prints for each HOW: seconds, and a sum of what was read. Built with -DCOLD=1 it lets the page cache go before each.
#define _GNU_SOURCE
#include <fcntl.h>
#include <liburing.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { kMostThreads = 16 };

static int file;
static size_t page_bytes;
static off_t* offsets;  // of the batch at hand, ascending
static char* buffers;   // of a batch
static int threads;
static size_t batch_pages;

static void fail(const char* what) {
  perror(what);
  exit(1);
}

static double seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int ascending(const void* a, const void* b) {
  const off_t x = *(const off_t*)a, y = *(const off_t*)b;
  return (x > y) - (x < y);
}

static void* readRun(void* number) {
  const size_t thread = (size_t)number;
  for (size_t i = batch_pages * thread / (size_t)threads; i < batch_pages * (thread + 1) / (size_t)threads; ++i) {
    for (size_t done = 0; done < page_bytes;) {
      const ssize_t got = pread(file, buffers + i * page_bytes + done, page_bytes - done, offsets[i] + (off_t)done);
      if (got <= 0) fail("pread");
      done += (size_t)got;
    }
  }
  return NULL;
}

// As renderer/resident/pages.cpp: threads of a batch's own.
static void readByThreads(void) {
  pthread_t others[kMostThreads];
  for (int i = 1; i < threads; ++i) {
    if (pthread_create(&others[i], NULL, readRun, (void*)(size_t)i) != 0) fail("pthread_create");
  }
  readRun(0);
  for (int i = 1; i < threads; ++i) pthread_join(others[i], NULL);
}

static void readByRing(struct io_uring* ring, unsigned depth) {
  size_t begun = 0, ended = 0;
  while (ended < batch_pages) {
    while (begun < batch_pages && begun - ended < depth) {
      struct io_uring_sqe* entry = io_uring_get_sqe(ring);
      if (entry == NULL) break;
      io_uring_prep_read(entry, file, buffers + begun * page_bytes, (unsigned)page_bytes, (unsigned long long)offsets[begun]);
      ++begun;
    }
    if (io_uring_submit_and_wait(ring, 1) < 0) fail("io_uring_submit_and_wait");
    struct io_uring_cqe* done;
    while (io_uring_peek_cqe(ring, &done) == 0) {
      if (done->res != (int)page_bytes) {
        fprintf(stderr, "io_uring read %d bytes of %zu\n", done->res, page_bytes);
        exit(1);
      }
      io_uring_cqe_seen(ring, done);
      ++ended;
    }
  }
}

int main(int count, char** arguments) {
  if (count < 7) {
    fprintf(stderr, "usage: page_reads FILE PAGE_BYTES PAGES BATCH SEED HOW[:N]...\n");
    return 2;
  }
  file = open(arguments[1], O_RDONLY);
  struct stat status;
  if (file < 0 || fstat(file, &status) != 0) fail(arguments[1]);
  page_bytes = strtoul(arguments[2], NULL, 10);
  const size_t pages = strtoul(arguments[3], NULL, 10), batch = strtoul(arguments[4], NULL, 10);
  srand48(atol(arguments[5]));
  off_t* all = malloc(pages * sizeof *all);
  buffers = malloc(batch * page_bytes);
  if (all == NULL || buffers == NULL) fail("malloc");
  memset(buffers, 1, batch * page_bytes);
  for (size_t i = 0; i < pages; ++i) all[i] = (off_t)(drand48() * (double)(status.st_size - (off_t)page_bytes));
  for (size_t begin = 0; begin < pages; begin += batch) {
    qsort(all + begin, pages - begin < batch ? pages - begin : batch, sizeof *all, ascending);
  }
  for (int i = 6; i < count; ++i) {
    const char* number = strchr(arguments[i], ':');
    const int n = number ? atoi(number + 1) : 1;
    const int by_ring = strncmp(arguments[i], "uring", 5) == 0, told = strncmp(arguments[i], "told", 4) == 0;
    struct io_uring ring;
    if (by_ring && io_uring_queue_init((unsigned)n, &ring, 0) != 0) {
      printf("%s none\n", arguments[i]);
      continue;
    }
    threads = n < kMostThreads ? n : kMostThreads;
    if (COLD) posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
    unsigned long sum = 0;
    const double begin = seconds();
    for (size_t at = 0; at < pages; at += batch) {
      offsets = all + at;
      batch_pages = pages - at < batch ? pages - at : batch;
      for (size_t page = 0; told && page < batch_pages; ++page) {
        posix_fadvise(file, offsets[page], (off_t)page_bytes, POSIX_FADV_WILLNEED);
      }
      by_ring ? readByRing(&ring, (unsigned)n) : readByThreads();
      for (size_t page = 0; page < batch_pages; ++page) sum += (unsigned char)buffers[page * page_bytes];
    }
    printf("%s %.6f %lu\n", arguments[i], seconds() - begin, sum);
    if (by_ring) io_uring_queue_exit(&ring);
  }
  return 0;
}

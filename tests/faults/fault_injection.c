// Makes chosen calls of a program fail: preloaded (LD_PRELOAD) into the program that a test runs.
//
// Only calls on files and folders below one folder count, by kinds; calls of one kind are numbered
// from 1, over all threads.
//
//   HEDDLE_FAULT_FOLDER    absolute path; without it, nothing is counted and nothing fails
//   HEDDLE_FAULT_LOG       a file: one line "KIND NUMBER PATH" for every call that counts, "FAULT "
//                          in front of those that fail
//   HEDDLE_FAULT_KIND      the kind that fails: one of kKinds below, or "change": every call that
//                          would change something
//   HEDDLE_FAULT_NUMBER    which call of that kind
//   HEDDLE_FAULT_ERROR     errno that it fails with; "short": a write takes half of its bytes;
//                          "kill": SIGKILL before the call
//   HEDDLE_FAULT_LASTING   where set: those after it fail as well. With "short", they fail with
//                          ENOSPC: the disk is full
//
// Which calls matter was read off strace and off what the libraries import: libstdc++ writes files
// by write, writev, fopen64 and fclose, OpenEXR and OpenVDB use its streams, remove and truncate
// come from it, too.

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

enum Kind {
  kWrite,
  kRead,
  kFlush,        // fsync of a file
  kFlushFolder,  // fsync of a folder
  kClose,        // of a file that is open for writing
  kRename,
  kOpenWrite,
  kOpenRead,
  kOpenFolder,
  kMakeFolder,
  kUnlink,  // of a file or folder
  kTruncate,
  kKindCount
};
static const char* const kKinds[kKindCount] = {
    "write",      "read",      "flush",       "flush-folder", "close",  "rename",
    "open-write", "open-read", "open-folder", "make-folder",  "unlink", "truncate"};

enum { kPathSize = 8192, kNone = -1, kAnyChange = kKindCount };
enum { kShort = -2, kKill = -3 };

static char folder[kPathSize];
static int fault_kind = kNone;
static long fault_number;
static int fault_error;
static int lasting;
static int log_descriptor = -1;
static atomic_long counts[kKindCount];

/// The program's own function behind ours.
#define REAL(name)               \
  static __typeof__(&name) real; \
  if (!real) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

__attribute__((constructor)) static void set_up(void) {
  const char* place = getenv("HEDDLE_FAULT_FOLDER");
  if (!place || strlen(place) >= sizeof folder) return;
  const char* log = getenv("HEDDLE_FAULT_LOG");
  if (log)
    log_descriptor =
        (int)syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  const char* kind = getenv("HEDDLE_FAULT_KIND");
  for (int k = 0; kind && k < kKindCount; ++k) {
    if (strcmp(kind, kKinds[k]) == 0) fault_kind = k;
  }
  if (kind && strcmp(kind, "change") == 0) fault_kind = kAnyChange;
  const char* number = getenv("HEDDLE_FAULT_NUMBER");
  fault_number = number ? atol(number) : 0;
  const char* error = getenv("HEDDLE_FAULT_ERROR");
  if (error)
    fault_error = strcmp(error, "short") == 0  ? kShort
                  : strcmp(error, "kill") == 0 ? kKill
                                               : atoi(error);
  lasting = getenv("HEDDLE_FAULT_LASTING") != NULL;
  strcpy(folder, place);
}

static void note(const char* prefix, enum Kind kind, long number, const char* path) {
  if (log_descriptor < 0) return;
  char line[kPathSize + 64];
  const int length =
      snprintf(line, sizeof line, "%s%s %ld %s\n", prefix, kKinds[kind], number, path);
  if (length > 0) syscall(SYS_write, log_descriptor, line, (size_t)length);
}

static int changes_something(enum Kind kind, const char* path) {
  // Even where nothing can be written, making a folder that is there fails with EEXIST.
  if (kind == kMakeFolder) return access(path, F_OK) != 0;
  return kind == kWrite || kind == kRename || kind == kOpenWrite || kind == kUnlink ||
         kind == kTruncate;
}

/// Counts a call. 0: it may go on; kShort; else the errno that it is to fail with.
static int fault_of(enum Kind kind, const char* path) {
  const size_t length = strlen(folder);
  if (length == 0 || strncmp(path, folder, length) != 0 ||
      (path[length] != '/' && path[length] != '\0'))
    return 0;
  const long number = ++counts[kind];
  int fails =
      (int)kind == fault_kind && (number == fault_number || (lasting && number > fault_number));
  if (fault_kind == kAnyChange) fails = changes_something(kind, path);
  if (!fails) {
    note("", kind, number, path);
    return 0;
  }
  note("FAULT ", kind, number, path);
  if (fault_error == kKill) kill(getpid(), SIGKILL);
  if (fault_error == kShort && number > fault_number) return ENOSPC;
  return fault_error;
}

static int descriptor_fault(enum Kind kind, int descriptor) {
  if (folder[0] == '\0') return 0;
  const int saved = errno;
  char link[64];
  char path[kPathSize];
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  errno = saved;
  if (length <= 0 || path[0] != '/') return 0;  // a pipe or a socket
  path[length] = '\0';
  return fault_of(kind, path);
}

/// `path` made absolute by the folder it is relative to.
static void absolute_path(int at, const char* path, char* absolute) {
  absolute[0] = '\0';
  ssize_t length = 0;
  if (path[0] != '/') {
    if (at == AT_FDCWD) {
      length = getcwd(absolute, kPathSize) ? (ssize_t)strlen(absolute) : 0;
    } else {
      char link[64];
      snprintf(link, sizeof link, "/proc/self/fd/%d", at);
      length = readlink(link, absolute, kPathSize - 1);
    }
    if (length < 0) length = 0;
    if (length < kPathSize - 1) absolute[length++] = '/';
  }
  snprintf(absolute + length, (size_t)(kPathSize - length), "%s", path);
}

static int path_fault(enum Kind kind, int at, const char* path) {
  if (folder[0] == '\0' || !path) return 0;
  const int saved = errno;
  char absolute[kPathSize];
  absolute_path(at, path, absolute);
  errno = saved;
  return fault_of(kind, absolute);
}

static int fail(int error) {
  errno = error;
  return -1;
}

// Where a fault is due: `return -1` with errno.
#define FAIL_IF(fault)          \
  const int injected = (fault); \
  if (injected > 0) return fail(injected)

static int open_fault(int at, const char* path, int flags) {
  if (folder[0] == '\0' || !path) return 0;
  const int saved = errno;
  struct stat status;
  const int is_folder =
      (flags & O_DIRECTORY) || (fstatat(at, path, &status, 0) == 0 && S_ISDIR(status.st_mode));
  errno = saved;
  if (is_folder) return path_fault(kOpenFolder, at, path);
  return path_fault((flags & (O_WRONLY | O_RDWR | O_CREAT)) ? kOpenWrite : kOpenRead, at, path);
}

#define TAKE_MODE(mode, flags)           \
  mode_t mode = 0;                       \
  if ((flags) & (O_CREAT | O_TMPFILE)) { \
    va_list arguments;                   \
    va_start(arguments, flags);          \
    mode = va_arg(arguments, mode_t);    \
    va_end(arguments);                   \
  }

int open(const char* path, int flags, ...) {
  TAKE_MODE(mode, flags)
  REAL(open);
  FAIL_IF(open_fault(AT_FDCWD, path, flags));
  return real(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  TAKE_MODE(mode, flags)
  REAL(open64);
  FAIL_IF(open_fault(AT_FDCWD, path, flags));
  return real(path, flags, mode);
}

int openat(int at, const char* path, int flags, ...) {
  TAKE_MODE(mode, flags)
  REAL(openat);
  FAIL_IF(open_fault(at, path, flags));
  return real(at, path, flags, mode);
}

int openat64(int at, const char* path, int flags, ...) {
  TAKE_MODE(mode, flags)
  REAL(openat64);
  FAIL_IF(open_fault(at, path, flags));
  return real(at, path, flags, mode);
}

static int stream_fault(const char* path, const char* mode) {
  return open_fault(AT_FDCWD, path, strpbrk(mode, "wa+") ? O_WRONLY | O_CREAT : O_RDONLY);
}

FILE* fopen(const char* path, const char* mode) {
  REAL(fopen);
  const int error = stream_fault(path, mode);
  if (error > 0) return fail(error), NULL;
  return real(path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
  REAL(fopen64);
  const int error = stream_fault(path, mode);
  if (error > 0) return fail(error), NULL;
  return real(path, mode);
}

static int closing_fault(int descriptor) {
  const int flags = fcntl(descriptor, F_GETFL);
  if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY) return 0;
  return descriptor_fault(kClose, descriptor);
}

// A close that fails has closed the file.
int close(int descriptor) {
  REAL(close);
  const int error = closing_fault(descriptor);
  const int result = real(descriptor);
  return error > 0 ? fail(error) : result;
}

int fclose(FILE* stream) {
  REAL(fclose);
  const int error = closing_fault(fileno(stream));
  const int result = real(stream);
  return error > 0 ? fail(error) : result;
}

static size_t taken(int error, size_t size) {
  return error == kShort ? (size + 1) / 2 : size;
}

ssize_t write(int descriptor, const void* bytes, size_t size) {
  REAL(write);
  FAIL_IF(descriptor_fault(kWrite, descriptor));
  return real(descriptor, bytes, taken(injected, size));
}

ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t offset) {
  REAL(pwrite);
  FAIL_IF(descriptor_fault(kWrite, descriptor));
  return real(descriptor, bytes, taken(injected, size), offset);
}

ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off64_t offset) {
  REAL(pwrite64);
  FAIL_IF(descriptor_fault(kWrite, descriptor));
  return real(descriptor, bytes, taken(injected, size), offset);
}

ssize_t writev(int descriptor, const struct iovec* parts, int count) {
  REAL(writev);
  FAIL_IF(descriptor_fault(kWrite, descriptor));
  if (injected != kShort) return real(descriptor, parts, count);
  for (int k = 0; k < count; ++k) {
    if (parts[k].iov_len > 0) {
      const struct iovec first = {parts[k].iov_base, taken(injected, parts[k].iov_len)};
      return real(descriptor, &first, 1);
    }
  }
  return 0;
}

ssize_t sendfile(int to, int from, off_t* offset, size_t size);
ssize_t sendfile(int to, int from, off_t* offset, size_t size) {
  REAL(sendfile);
  FAIL_IF(descriptor_fault(kWrite, to));
  return real(to, from, offset, taken(injected, size));
}

ssize_t read(int descriptor, void* bytes, size_t size) {
  REAL(read);
  FAIL_IF(descriptor_fault(kRead, descriptor));
  return real(descriptor, bytes, taken(injected, size));
}

ssize_t pread(int descriptor, void* bytes, size_t size, off_t offset) {
  REAL(pread);
  FAIL_IF(descriptor_fault(kRead, descriptor));
  return real(descriptor, bytes, taken(injected, size), offset);
}

static int flush_fault(int descriptor) {
  const int saved = errno;
  struct stat status;
  const int is_folder = fstat(descriptor, &status) == 0 && S_ISDIR(status.st_mode);
  errno = saved;
  return descriptor_fault(is_folder ? kFlushFolder : kFlush, descriptor);
}

int fsync(int descriptor) {
  REAL(fsync);
  FAIL_IF(flush_fault(descriptor));
  return real(descriptor);
}

int fdatasync(int descriptor) {
  REAL(fdatasync);
  FAIL_IF(flush_fault(descriptor));
  return real(descriptor);
}

// A rename counts by the name that it gives.
int rename(const char* from, const char* to) {
  REAL(rename);
  FAIL_IF(path_fault(kRename, AT_FDCWD, to));
  return real(from, to);
}

int renameat(int from_at, const char* from, int to_at, const char* to) {
  REAL(renameat);
  FAIL_IF(path_fault(kRename, to_at, to));
  return real(from_at, from, to_at, to);
}

int renameat2(int from_at, const char* from, int to_at, const char* to, unsigned int flags) {
  REAL(renameat2);
  FAIL_IF(path_fault(kRename, to_at, to));
  return real(from_at, from, to_at, to, flags);
}

int mkdir(const char* path, mode_t mode) {
  REAL(mkdir);
  FAIL_IF(path_fault(kMakeFolder, AT_FDCWD, path));
  return real(path, mode);
}

int mkdirat(int at, const char* path, mode_t mode) {
  REAL(mkdirat);
  FAIL_IF(path_fault(kMakeFolder, at, path));
  return real(at, path, mode);
}

int unlink(const char* path) {
  REAL(unlink);
  FAIL_IF(path_fault(kUnlink, AT_FDCWD, path));
  return real(path);
}

int unlinkat(int at, const char* path, int flags) {
  REAL(unlinkat);
  FAIL_IF(path_fault(kUnlink, at, path));
  return real(at, path, flags);
}

int rmdir(const char* path) {
  REAL(rmdir);
  FAIL_IF(path_fault(kUnlink, AT_FDCWD, path));
  return real(path);
}

int remove(const char* path) {
  REAL(remove);
  FAIL_IF(path_fault(kUnlink, AT_FDCWD, path));
  return real(path);
}

int truncate(const char* path, off_t size) {
  REAL(truncate);
  FAIL_IF(path_fault(kTruncate, AT_FDCWD, path));
  return real(path, size);
}

int ftruncate(int descriptor, off_t size) {
  REAL(ftruncate);
  FAIL_IF(descriptor_fault(kTruncate, descriptor));
  return real(descriptor, size);
}

int ftruncate64(int descriptor, off64_t size) {
  REAL(ftruncate64);
  FAIL_IF(descriptor_fault(kTruncate, descriptor));
  return real(descriptor, size);
}

/* A disk that can be full, read-only or slow, and that remembers what was written and synced in
 * which order, so that a test can rebuild what a power cut would have left.
 *
 * Preloaded into a child process. DISK_FOLDER: the folder it stands for. DISK_CONTROL: a file that
 * says how the disk is: "full", "readonly", "slow-sync", "slow-write" or nothing. DISK_LOG: where
 * operations are noted, "" for nowhere. A note: kind (1 byte), time (8, ns), length of the name (4),
 * offset (8), length of the data (4), name, data. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;

/* Whether a path is on the disk; "marks" are the test's own. */
static int below(const char *path) {
    const char *folder = getenv("DISK_FOLDER");
    size_t length = folder ? strlen(folder) : 0;
    return length && !strncmp(path, folder, length) && (path[length] == '/' || !path[length]);
}

static int is_marks(const char *path) {
    size_t length = strlen(path);
    return length > 6 && !strcmp(path + length - 6, "/marks");
}

/* The name of a descriptor's file if that is below the folder. */
static int name_of(int fd, char *name) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, name, PATH_MAX - 1);
    if (length <= 0) return 0;
    name[length] = 0;
    return below(name);
}

static int is(const char *state) {
    const char *control = getenv("DISK_CONTROL");
    char text[32] = "";
    if (!control) return 0;
    int fd = syscall(SYS_openat, AT_FDCWD, control, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return 0;
    ssize_t length = syscall(SYS_read, fd, text, sizeof text - 1);
    syscall(SYS_close, fd);
    if (length < 0) return 0;
    return !strcmp(text, state);
}

static void stall(const char *state) {
    struct timespec pause = {0, 20000000};
    while (is(state)) nanosleep(&pause, NULL);
}

static void note(char kind, const char *name, int64_t offset, const void *data, uint32_t length) {
    const char *log = getenv("DISK_LOG");
    static int fd = -1;
    struct timespec now;
    if (!log || !*log) return;
    if (fd < 0) fd = syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    clock_gettime(CLOCK_MONOTONIC, &now);
    int64_t ns = now.tv_sec * 1000000000LL + now.tv_nsec;
    uint32_t name_length = strlen(name);
    char *whole = malloc(25 + name_length + length), *at = whole;
    *at++ = kind;
    memcpy(at, &ns, 8), at += 8;
    memcpy(at, &name_length, 4), at += 4;
    memcpy(at, &offset, 8), at += 8;
    memcpy(at, &length, 4), at += 4;
    memcpy(at, name, name_length), at += name_length;
    if (length) memcpy(at, data, length);
    syscall(SYS_write, fd, whole, 25 + name_length + (size_t)length);
    free(whole);
}

static ssize_t put(int fd, const void *data, size_t length, int64_t offset, int is_at) {
    char name[PATH_MAX];
    if (!name_of(fd, name))
        return is_at ? syscall(SYS_pwrite64, fd, data, length, offset) : syscall(SYS_write, fd, data, length);
    if (!is_marks(name)) stall("slow-write");
    if (is("full") && !is_marks(name)) { errno = ENOSPC; return -1; }
    pthread_mutex_lock(&mutex);
    if (!is_at) offset = lseek(fd, 0, SEEK_CUR);
    ssize_t done = syscall(SYS_pwrite64, fd, data, length, offset);
    if (done > 0) {
        note('W', name, offset, data, done);
        if (!is_at) lseek(fd, offset + done, SEEK_SET);
    }
    pthread_mutex_unlock(&mutex);
    return done;
}

ssize_t write(int fd, const void *data, size_t length) { return put(fd, data, length, 0, 0); }
ssize_t pwrite(int fd, const void *data, size_t length, off_t at) { return put(fd, data, length, at, 1); }
ssize_t pwrite64(int fd, const void *data, size_t length, off64_t at) { return put(fd, data, length, at, 1); }

static int cut(int fd, int64_t length) {
    char name[PATH_MAX];
    if (!name_of(fd, name)) return syscall(SYS_ftruncate, fd, length);
    pthread_mutex_lock(&mutex);
    int result = syscall(SYS_ftruncate, fd, length);
    if (!result) note('T', name, length, "", 0);
    pthread_mutex_unlock(&mutex);
    return result;
}

int ftruncate(int fd, off_t length) { return cut(fd, length); }
int ftruncate64(int fd, off64_t length) { return cut(fd, length); }

/* What was written before a sync began lasts when it has ended. */
static int sync_it(long number, int fd) {
    char name[PATH_MAX];
    static int64_t last;
    if (!name_of(fd, name)) return syscall(number, fd);
    stall("slow-sync");
    pthread_mutex_lock(&mutex);
    int64_t mine = ++last;
    note('B', name, mine, "", 0);
    pthread_mutex_unlock(&mutex);
    int result = syscall(number, fd);
    pthread_mutex_lock(&mutex);
    if (!result) note('E', name, mine, "", 0);
    pthread_mutex_unlock(&mutex);
    return result;
}

int fsync(int fd) { return sync_it(SYS_fsync, fd); }
int fdatasync(int fd) { return sync_it(SYS_fdatasync, fd); }

static int open_it(int folder, const char *path, int flags, mode_t mode) {
    int writes = (flags & O_ACCMODE) != O_RDONLY || (flags & O_CREAT);
    if (!below(path)) return syscall(SYS_openat, folder, path, flags, mode);
    if (writes && is("readonly") && !is_marks(path)) { errno = EROFS; return -1; }
    if (flags & O_CREAT && is("full") && access(path, F_OK) && !is_marks(path)) { errno = ENOSPC; return -1; }
    pthread_mutex_lock(&mutex);
    int is_new = (flags & O_CREAT) && access(path, F_OK);
    int fd = syscall(SYS_openat, folder, path, flags, mode);
    if (fd >= 0 && is_new) note('C', path, 0, "", 0);
    pthread_mutex_unlock(&mutex);
    return fd;
}

#define MODE                                  \
    mode_t mode = 0;                          \
    if (flags & (O_CREAT | __O_TMPFILE)) {    \
        va_list rest;                         \
        va_start(rest, flags);                \
        mode = va_arg(rest, mode_t);          \
        va_end(rest);                         \
    }

int open(const char *path, int flags, ...) { MODE return open_it(AT_FDCWD, path, flags, mode); }
int open64(const char *path, int flags, ...) { MODE return open_it(AT_FDCWD, path, flags | O_LARGEFILE, mode); }
int openat(int folder, const char *path, int flags, ...) { MODE return open_it(folder, path, flags, mode); }
int openat64(int folder, const char *path, int flags, ...) { MODE return open_it(folder, path, flags | O_LARGEFILE, mode); }

int unlink(const char *path) {
    if (!below(path)) return syscall(SYS_unlinkat, AT_FDCWD, path, 0);
    if (is("readonly")) { errno = EROFS; return -1; }
    pthread_mutex_lock(&mutex);
    int result = syscall(SYS_unlinkat, AT_FDCWD, path, 0);
    if (!result) note('U', path, 0, "", 0);
    pthread_mutex_unlock(&mutex);
    return result;
}

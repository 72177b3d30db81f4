/* Faults of the file system and of the system, for tests: loaded before the C library (LD_PRELOAD).
 *
 * FAULT_UNDER  only files below this directory; empty: all
 * FAULT_CALL   write, fsync, rename, link, open, unlink, pthread_create
 * FAULT_ERROR  an error number; 0: a short write, -1: a slow one (2 ms)
 * FAULT_FROM   the first call that fails, from 1
 * FAULT_COUNT  so many fail; 0: all from then on
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

static atomic_long seen;

static const char *option(const char *name, const char *otherwise) {
    const char *value = getenv(name);
    return value ? value : otherwise;
}

/* The error of this call, or 0: none. Counts the call. */
static int fault(const char *call, const char *path) {
    const char *under = option("FAULT_UNDER", "");
    if (strcmp(call, option("FAULT_CALL", "")) || strncmp(path, under, strlen(under))) return 0;
    long number = atomic_fetch_add(&seen, 1) + 1;
    long from = atol(option("FAULT_FROM", "1")), count = atol(option("FAULT_COUNT", "0"));
    if (number < from || (count > 0 && number >= from + count)) return 0;
    int error = atoi(option("FAULT_ERROR", "5"));
    return error == 0 ? INT_MAX : error;
}

static const char *path_of(int fd, char *buffer) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, buffer, PATH_MAX - 1);
    buffer[length < 0 ? 0 : length] = 0;
    return buffer;
}

static const char *absolute(const char *path, char *buffer) {
    if (path[0] == '/' || !getcwd(buffer, PATH_MAX / 2)) return path;
    strncat(buffer, "/", 2);
    strncat(buffer, path, PATH_MAX / 2 - 2);
    return buffer;
}

#define NEXT(result, name, ...) ((result(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name))

ssize_t write(int fd, const void *data, size_t length) {
    char buffer[PATH_MAX];
    int error = fd > 2 ? fault("write", path_of(fd, buffer)) : 0;
    if (error == INT_MAX && length > 1) length /= 2;
    else if (error == -1) usleep(2000);
    else if (error > 0 && error != INT_MAX) return errno = error, -1;
    return NEXT(ssize_t, "write", int, const void *, size_t)(fd, data, length);
}

static int synced(int fd, const char *name) {
    char buffer[PATH_MAX];
    int error = fault("fsync", path_of(fd, buffer));
    if (error > 0) return errno = error, -1;
    return NEXT(int, name, int)(fd);
}
int fsync(int fd) { return synced(fd, "fsync"); }
int fdatasync(int fd) { return synced(fd, "fdatasync"); }

static int paths(const char *call, const char *to) {
    char buffer[PATH_MAX];
    int error = fault(call, absolute(to, buffer));
    return error > 0 ? (errno = error, -1) : 0;
}
int rename(const char *from, const char *to) {
    return paths("rename", to) ? -1 : NEXT(int, "rename", const char *, const char *)(from, to);
}
int link(const char *from, const char *to) {
    return paths("link", to) ? -1 : NEXT(int, "link", const char *, const char *)(from, to);
}
int linkat(int a, const char *from, int b, const char *to, int flags) {
    if (paths("link", to)) return -1;
    return NEXT(int, "linkat", int, const char *, int, const char *, int)(a, from, b, to, flags);
}
int unlink(const char *path) { return paths("unlink", path) ? -1 : NEXT(int, "unlink", const char *)(path); }

static int opened(const char *name, const char *path, int flags, mode_t mode) {
    if ((flags & (O_CREAT | O_WRONLY | O_RDWR)) && paths("open", path)) return -1;
    return NEXT(int, name, const char *, int, mode_t)(path, flags, mode);
}
int open(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return opened("open", path, flags, mode);
}
int open64(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return opened("open64", path, flags, mode);
}

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *), void *argument) {
    int error = fault("pthread_create", option("FAULT_UNDER", ""));
    if (error > 0) return error;
    return NEXT(int, "pthread_create", pthread_t *, const pthread_attr_t *, void *(*)(void *), void *)(
        thread, attributes, run, argument);
}

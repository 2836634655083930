/* Library for LD_PRELOAD that makes one memory allocation of a thread fail: a call of malloc,
 * calloc, realloc or mmap.
 *
 * The library counts large allocations, and allocations that code in a specified folder requests
 * directly or through Python. Other allocations never fail, because NumPy and Python cannot handle
 * every failure of a small allocation. If a small allocation fails, a NumPy iterator may crash, or
 * a lock of Python's thread pool may remain locked. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <stddef.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#define LARGE 100000 /* in bytes */
#define DEPTH \
    12 /* maximum number of stack frames that are searched for the caller of an allocation */

extern void *__libc_malloc(size_t);
extern void *__libc_calloc(size_t, size_t);
extern void *__libc_realloc(void *, size_t);

static _Thread_local const char *folder;
static _Thread_local long seen, failing;

/* Starts counting all large allocations, and the allocations by code in the folder `own`. The
 * allocations are numbered from 0, and allocation n fails. If n is negative, no allocation fails.
 * If `own` is NULL, allocations are no longer counted. */
void fail_allocation(const char *own, long n)
{
    folder = NULL;
    void *frames[1];
    backtrace(frames, 1); /* the first call of backtrace allocates memory */
    failing = n;
    seen = 0;
    folder = own;
}

/* Returns the number of counted allocations since the last call of fail_allocation. */
long count_allocations(void)
{
    return seen;
}

static int is_in(const char *file, const char *name)
{
    const char *last = strrchr(file, '/');
    return !strncmp(last ? last + 1 : file, name, strlen(name));
}

/* Tests whether code in the folder `own` requested the current allocation. */
static int is_own(const char *own)
{
    void *frames[DEPTH];
    int depth = backtrace(frames, DEPTH);
    Dl_info self;
    dladdr((void *)fail_allocation, &self);
    for (int i = 0; i < depth; i++) {
        Dl_info info;
        if (!dladdr(frames[i], &info) || !info.dli_fname) {
            return 0;
        }
        if (!strncmp(info.dli_fname, own, strlen(own)) && !strstr(info.dli_fname, "/numpy")) {
            return 1;
        }
        if (info.dli_sname && !strcmp(info.dli_sname, "_PyEval_EvalFrameDefault")) {
            return 0;
        }
        if (info.dli_fbase != self.dli_fbase && !is_in(info.dli_fname, "libpython") &&
            !is_in(info.dli_fname, "python")) {
            return 0;
        }
    }
    return 0;
}

static int fails(size_t size)
{
    const char *own = folder;
    folder = NULL; /* allocations of backtrace are not counted */
    int is_counted = own && (size >= LARGE || is_own(own));
    folder = own;
    if (!is_counted || seen++ != failing) {
        return 0;
    }
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t size)
{
    return fails(size) ? NULL : __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    return fails(count * size) ? NULL : __libc_calloc(count, size);
}

void *realloc(void *memory, size_t size)
{
    return fails(size) ? NULL : __libc_realloc(memory, size);
}

void *mmap(void *at, size_t size, int protection, int flags, int file, off_t offset)
{
    return fails(size) ? MAP_FAILED
                       : (void *)syscall(SYS_mmap, at, size, protection, flags, file, offset);
}

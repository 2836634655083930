/* The POSIX functions for libraries, memory pages and threads, and their equivalents on Windows. */
#pragma once

#ifndef _WIN32
#include <dlfcn.h>
#include <pthread.h>
#include <sys/mman.h>
#else
#include <process.h>
#include <windows.h>

#define MAX_WIDE_PATH 32768 /* maximum length of a path on Windows, in UTF-16 units */
#define MAX_REASON 512      /* maximum length of a system error message, in bytes */

/* The path is UTF-8, as PyUnicode_FSConverter returns it. */
#define dlopen(path, mode) open_library_file(path)
#define dlsym(library, name) ((void *)GetProcAddress(library, name))
#define dlclose(library) FreeLibrary(library)
#define dlerror() last_error((char[MAX_REASON]){0})

#define MAP_FAILED NULL
#define mmap(address, size, ...) \
    VirtualAlloc(address, size, MEM_RESERVE | MEM_COMMIT, PAGE_READWRITE)
#define munmap(pages, size) VirtualFree(pages, 0, MEM_RELEASE)

#define pthread_t HANDLE
#define pthread_create(thread, attributes, work, argument) start_thread(thread, work, argument)
#define pthread_join(thread, result) (WaitForSingleObject(thread, INFINITE), CloseHandle(thread))

static inline HMODULE open_library_file(const char *path)
{
    WCHAR wide[MAX_WIDE_PATH];
    const int n = MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, MAX_WIDE_PATH);
    return n ? LoadLibraryW(wide) : NULL;
}

static inline const char *last_error(char *reason)
{
    const DWORD flags =
        FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS | FORMAT_MESSAGE_MAX_WIDTH_MASK;
    FormatMessageA(flags, NULL, GetLastError(), 0, reason, MAX_REASON, NULL);
    return reason;
}

static inline int start_thread(HANDLE *thread, void *(*work)(void *), void *argument)
{
    /* The cast is safe: 64-bit Windows has one calling convention, and no code reads the exit code.
     */
    *thread = (HANDLE)_beginthreadex(NULL, 0, (void *)work, argument, 0, NULL);
    return *thread ? 0 : -1;
}
#endif

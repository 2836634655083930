#include "call/kernel/buffer_pool.h"

#include <stdint.h>
#include <string.h>

#include "call/kernel/posix.h"

#define MAX_BYTES ((size_t)256 << 20) /* total size of all blocks in the pool, in bytes */
#define MAX_BLOCKS 32                 /* blocks */
#define HUGE_PAGE ((size_t)2 << 20)   /* unit of block sizes, in bytes */
#define BLOCK_HEAD 64                 /* bytes before the array, which store the block size */

typedef struct {
    char *start;
    size_t size;
} Block;

static struct {
    Block blocks[MAX_BLOCKS]; /* blocks, the oldest first */
    int n;
    size_t bytes;
} kept;

static Block block_of(void *memory)
{
    char *start = (char *)memory - BLOCK_HEAD;
    return (Block){start, *(size_t *)start};
}

static Block take_kept(int i)
{
    Block block = kept.blocks[i];
    kept.n--;
    kept.bytes -= block.size;
    memmove(kept.blocks + i, kept.blocks + i + 1, (kept.n - i) * sizeof *kept.blocks);
    return block;
}

/* Releases the oldest blocks until at most n blocks and `bytes` bytes are left. */
static void shrink_kept(int n, size_t bytes)
{
    while (kept.n > n || kept.bytes > bytes) {
        Block block = take_kept(0);
        munmap(block.start, block.size);
    }
}

/* Returns the index of the smallest unused block with `size` to 1.25 `size` bytes, or -1. */
static int find_kept(size_t size)
{
    int best = -1;
    for (int i = 0; i < kept.n; i++) {
        size_t own = kept.blocks[i].size;
        if (own >= size && own <= size + size / 4 && (best < 0 || own < kept.blocks[best].size)) {
            best = i;
        }
    }
    return best;
}

static void *block_new(void *Py_UNUSED(context), size_t n)
{
    if (n > (size_t)PY_SSIZE_T_MAX - BLOCK_HEAD - HUGE_PAGE) {
        return NULL;
    }
    size_t size = (n + BLOCK_HEAD + HUGE_PAGE - 1) / HUGE_PAGE * HUGE_PAGE;
    int found = find_kept(size);
    Block block = {MAP_FAILED, size};
    if (found >= 0) {
        block = take_kept(found);
    } else {
        block.start = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (block.start == MAP_FAILED) {
            return NULL;
        }
#ifdef MADV_HUGEPAGE
        madvise(block.start, size, MADV_HUGEPAGE);
#endif
    }
    *(size_t *)block.start = block.size;
    return block.start + BLOCK_HEAD;
}

static void block_free(void *Py_UNUSED(context), void *memory, size_t Py_UNUSED(n))
{
    if (!memory) {
        return;
    }
    Block block = block_of(memory);
    if (block.size > MAX_BYTES) {
        munmap(block.start, block.size);
        return;
    }
    shrink_kept(MAX_BLOCKS - 1, MAX_BYTES - block.size);
    kept.blocks[kept.n++] = block;
    kept.bytes += block.size;
#ifdef MADV_FREE
    /* Allows the system to reclaim the memory pages and to drop their contents. */
    madvise(block.start, block.size, MADV_FREE);
#endif
}

static void *block_new_zeroed(void *context, size_t n, size_t size)
{
    void *memory = size && n > SIZE_MAX / size ? NULL : block_new(context, n * size);
    return memory ? memset(memory, 0, n * size) : NULL;
}

static void *block_resize(void *context, void *memory, size_t n)
{
    void *other = block_new(context, n);
    if (other && memory) {
        size_t size = block_of(memory).size - BLOCK_HEAD;
        memcpy(other, memory, size < n ? size : n);
        block_free(context, memory, size);
    }
    return other;
}

static PyDataMem_Handler block_handler = {
    "chasles_results", 1, {NULL, block_new, block_new_zeroed, block_resize, block_free}};

static PyObject *block_capsule;

int buffer_pool_init(void)
{
    block_capsule = PyCapsule_New(&block_handler, "mem_handler", NULL);
    return block_capsule ? 0 : -1;
}

PyObject *new_large(int ndim, npy_intp *dims)
{
    PyObject *chosen = PyDataMem_GetHandler();
    if (!chosen || chosen != PyDataMem_DefaultHandler) {
        Py_XDECREF(chosen);
        return chosen ? PyArray_SimpleNew(ndim, dims, NPY_DOUBLE) : NULL;
    }
    PyObject *before = PyDataMem_SetHandler(block_capsule);
    PyObject *result = before ? PyArray_SimpleNew(ndim, dims, NPY_DOUBLE) : NULL;
    PyObject *own = before ? PyDataMem_SetHandler(chosen) : NULL;
    if (!own) {
        Py_CLEAR(result);
    }
    Py_XDECREF(own);
    Py_XDECREF(before);
    Py_DECREF(chosen);
    return result;
}

PyObject *release_memory(PyObject *Py_UNUSED(module), PyObject *Py_UNUSED(ignored))
{
    size_t bytes = kept.bytes;
    shrink_kept(0, 0);
    return PyLong_FromSize_t(bytes);
}

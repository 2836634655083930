// Calls compiled robot functions from XLA. The attribute `kernel` is the address of a
// chasles_kernel; inputs and outputs are dense rows of doubles, or of floats that are converted.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

#include "_kernel.h"
#include "xla/ffi/api/ffi.h"

namespace ffi = xla::ffi;

namespace
{

constexpr std::size_t page = 4096;      // byte
constexpr std::size_t large = 1u << 22; // size of a result from which huge pages help (byte)
constexpr std::size_t block = 256; // rows that are converted at once, so that they stay in cache

// Calls a function for n rows.
void evaluate(const chasles_kernel &kernel, std::size_t n, std::vector<const double *> inputs,
              std::vector<double *> outputs)
{
    const int *sizes = kernel.sizes;
    std::vector<std::ptrdiff_t> steps(sizes, sizes + inputs.size() + outputs.size());
    if (kernel.rows != nullptr) {
        kernel.rows(n, inputs.data(), steps.data(), outputs.data(), steps.data() + inputs.size());
        return;
    }
    for (std::size_t row = 0; row < n; ++row) {
        kernel.call(inputs.data(), outputs.data());
        for (std::size_t k = 0; k < inputs.size(); ++k) {
            inputs[k] += steps[k];
        }
        for (std::size_t k = 0; k < outputs.size(); ++k) {
            outputs[k] += steps[inputs.size() + k];
        }
    }
}

// Calls a function for n rows of floats, in blocks of doubles.
void evaluate_floats(const chasles_kernel &kernel, std::size_t n,
                     const std::vector<const float *> &inputs, const std::vector<float *> &outputs)
{
    const int *sizes = kernel.sizes, *output_sizes = sizes + inputs.size();
    std::vector<std::vector<double>> in(inputs.size()), out(outputs.size());
    std::vector<const double *> from(inputs.size());
    std::vector<double *> to(outputs.size());
    for (std::size_t k = 0; k < inputs.size(); ++k) {
        in[k].resize(block * static_cast<std::size_t>(sizes[k]));
        from[k] = in[k].data();
    }
    for (std::size_t k = 0; k < outputs.size(); ++k) {
        out[k].resize(block * static_cast<std::size_t>(output_sizes[k]));
        to[k] = out[k].data();
    }
    for (std::size_t row = 0; row < n; row += block) {
        const std::size_t rows = std::min(block, n - row);
        for (std::size_t k = 0; k < inputs.size(); ++k) {
            const auto size = static_cast<std::size_t>(sizes[k]);
            std::copy_n(inputs[k] + row * size, rows * size, in[k].begin());
        }
        evaluate(kernel, rows, from, to);
        for (std::size_t k = 0; k < outputs.size(); ++k) {
            const auto size = static_cast<std::size_t>(output_sizes[k]);
            std::transform(out[k].begin(), out[k].begin() + rows * size, outputs[k] + row * size,
                           [](double value) { return static_cast<float>(value); });
        }
    }
}

template <typename Value> std::vector<const Value *> pointers(ffi::RemainingArgs arguments)
{
    std::vector<const Value *> found;
    for (std::size_t k = 0; k < arguments.size(); ++k) {
        found.push_back(
            static_cast<const Value *>(arguments.get<ffi::AnyBuffer>(k)->untyped_data()));
    }
    return found;
}

// Asks for huge pages: a large result is new memory, and the system clears it page by page. The
// advice includes the pages at both ends. Without these pages, it would split the mapping, and the
// system would clear the memory next to the split in small pages.
void prepare([[maybe_unused]] void *result, [[maybe_unused]] std::size_t bytes)
{
#ifdef MADV_HUGEPAGE
    if (bytes >= large) {
        const auto start = reinterpret_cast<std::uintptr_t>(result), first = start / page * page;
        madvise(reinterpret_cast<void *>(first), start + bytes - first, MADV_HUGEPAGE);
    }
#endif
}

template <typename Value> std::vector<Value *> pointers(ffi::RemainingRets results)
{
    std::vector<Value *> found;
    for (std::size_t k = 0; k < results.size(); ++k) {
        auto result = *results.get<ffi::AnyBuffer>(k);
        prepare(result->untyped_data(), result->size_bytes());
        found.push_back(static_cast<Value *>(result->untyped_data()));
    }
    return found;
}

ffi::Error call(ffi::RemainingArgs arguments, ffi::RemainingRets results, std::int64_t address)
{
    const auto &kernel = *reinterpret_cast<const chasles_kernel *>(address);
    auto first = *results.get<ffi::AnyBuffer>(0);
    const std::size_t n =
        first->element_count() / static_cast<std::size_t>(kernel.sizes[kernel.n_inputs]);
    if (first->element_type() == ffi::F64) {
        evaluate(kernel, n, pointers<double>(arguments), pointers<double>(results));
    } else {
        evaluate_floats(kernel, n, pointers<float>(arguments), pointers<float>(results));
    }
    return ffi::Error::Success();
}

} // namespace

XLA_FFI_DEFINE_HANDLER_SYMBOL(
    chasles_rows, call,
    ffi::Ffi::Bind().RemainingArgs().RemainingRets().Attr<std::int64_t>("kernel"));

"""Runs C in single precision on a Cortex-M4 in QEMU, and counts the executed instructions."""

import subprocess
from pathlib import Path

import numpy as np

CC = "arm-none-eabi-gcc"
QEMU = "qemu-system-arm"
FLAGS = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-fno-math-errno"]
TICKS_PER_INSTRUCTION = 1.6
"""An instruction takes 64 ns in QEMU (``-icount shift=6``). A tick of the 25 MHz timer takes 40
ns."""
LINKED = """\
MEMORY { code (rx) : ORIGIN = 0, LENGTH = 4M  data (rw) : ORIGIN = 0x20000000, LENGTH = 4M }
SECTIONS {
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) } > code
  .data : { *(.data*) *(.bss*) *(COMMON) } > data
  /DISCARD/ : { *(.ARM.exidx*) }
}
"""
MACHINE = """\
#include <stdint.h>

#define TIMER ((volatile uint32_t *)0xE000E010)

int main(void);
static void call(int operation, const void *argument)
{
  register int r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
}

static void started(void)
{
  *(volatile uint32_t *)0xE000ED88 |= 0xF << 20; /* the floating-point unit */
  __asm__ volatile("dsb\\nisb");
  TIMER[1] = 0xFFFFFF;
  TIMER[2] = 0;
  TIMER[0] = 5;
  main();
  call(0x18, (const void *)0x20026);
}

__attribute__((section(".vectors"), used)) static const void *const vectors[] = {
    (const void *)0x20400000, (const void *)started};

static void put(uint32_t word)
{
  static char text[10];
  for (int k = 0; k < 8; k++) {
    text[k] = "0123456789abcdef"[word >> (28 - 4 * k) & 15];
  }
  text[8] = '\\n';
  call(4, text);
}
"""
LOOP = """\
#include "{header}"
#include "machine.h"

static const union {{ uint32_t words[{size}]; float values[{size}]; }} inputs = {{{{{words}}}}};
static union {{ uint32_t words[{results}]; float values[{results}]; }} result;

int main(void)
{{
  for (int k = 0; k < {count}; k++) {{
    const float *x = inputs.values + {width} * k;
    float *y = result.values;
    const uint32_t before = TIMER[2];
    {call};
    put((before - TIMER[2]) & 0xFFFFFF);
    for (int i = 0; i < {results}; i++) {{
      put(result.words[i]);
    }}
  }}
  return 0;
}}
"""


def results(folder: Path, source: str, call: str, inputs: np.ndarray, size: int):
    """Call a C function for each row of the inputs (m, k).

    Returns instruction counts (m,) and results (m, size).

    Args:
        folder: The folder of the exported code.
        source: The name of the C file.
        call: C code that calls the function with the inputs x and the outputs y.
        inputs: The inputs of the function, in single precision.
        size: The number of results of the function.
    """
    inputs = np.ascontiguousarray(inputs, dtype=np.float32)
    text = LOOP.format(
        header=Path(source).with_suffix(".h"),
        words=", ".join(map(hex, inputs.view(np.uint32).ravel().tolist())),
        size=inputs.size,
        results=size,
        count=len(inputs),
        width=inputs.shape[1],
        call=call,
    )
    files = {"machine.h": MACHINE, "machine.ld": LINKED, "main.c": text}
    for name, content in files.items():
        (folder / name).write_text(content)
    options = ["-std=c99", "-O2", "-nostartfiles", "-T", "machine.ld", "-o", "program.elf"]
    command = [CC, *FLAGS, *options, source, "main.c", "-lm"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    machine = ["-machine", "mps2-an386", "-nographic", "-semihosting", "-icount", "shift=6"]
    run = [QEMU, *machine, "-monitor", "none", "-serial", "none", "-kernel", "program.elf"]
    done = subprocess.run(run, cwd=folder, check=True, capture_output=True, timeout=60)
    printed = done.stdout + done.stderr
    words = np.array([int(word, 16) for word in printed.split()], dtype=np.uint32)
    rows = words.reshape(len(inputs), 1 + size)
    return rows[:, 0] / TICKS_PER_INSTRUCTION, np.ascontiguousarray(rows[:, 1:]).view(np.float32)

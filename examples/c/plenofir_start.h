// SPDX-License-Identifier: Apache-2.0
// A refocuser behind a bus, set up from C: see plenofir_start.c.

#ifndef PLENOFIR_START_H
#define PLENOFIR_START_H

#include <stdint.h>

// How words of 32 bits are read and written, by their addresses in bytes.
struct plenofir_bus {
  void *context;
  uint32_t (*read)(void *context, uint32_t address);
  void (*write)(void *context, uint32_t address, uint32_t word);
};

// Sets the frame size, the slice with the shift a', and lets frames in. Returns the slice's number, or
//   -1 no refocuser of this register map is there
//   -2 none of its slices has this shift
//   -3 it does not take frames of this size
int plenofir_start(const struct plenofir_bus *bus, uint32_t columns, uint32_t rows, int32_t shift);

#endif

// SPDX-License-Identifier: Apache-2.0
// Sets a refocuser up from C, with the header that is built from the register map.
//
// As a program for Linux, with the core as a UIO device (docs/registers.md):
//
//   cc -std=c99 -Wall -DPLENOFIR_MAIN -I ../../hdl/axi -o plenofir_start plenofir_start.c
//   ./plenofir_start /dev/uio0 1280 720 -3

#include "plenofir_start.h"

#include "plenofir_registers.h"

// A field of a word, and a word of a field.
#define FIELD(name, word) (((word) & PLENOFIR_##name##_MASK) >> PLENOFIR_##name##_SHIFT)
#define PUT(name, value) (((uint32_t)(value) << PLENOFIR_##name##_SHIFT) & PLENOFIR_##name##_MASK)

static uint32_t get(const struct plenofir_bus *bus, uint32_t address) { return bus->read(bus->context, address); }

static void put(const struct plenofir_bus *bus, uint32_t address, uint32_t word) {
  bus->write(bus->context, address, word);
}

int plenofir_start(const struct plenofir_bus *bus, uint32_t columns, uint32_t rows, int32_t shift) {
  if (get(bus, PLENOFIR_IDENTIFICATION_ADDR) != PLENOFIR_IDENTIFICATION_VALUE) return -1;
  if (FIELD(VERSION_MAP, get(bus, PLENOFIR_VERSION_ADDR)) != PLENOFIR_MAP_NUMBER) return -1;
  if (!FIELD(PARTS_REFOCUSER, get(bus, PLENOFIR_PARTS_ADDR))) return -1;

  uint32_t slices = FIELD(GEOMETRY_SLICES, get(bus, PLENOFIR_GEOMETRY_ADDR));
  uint32_t wanted = PUT(SLICE_SHIFT_SHIFT, shift);
  uint32_t number;
  for (number = 0; number < slices; number++) {
    put(bus, PLENOFIR_ASKED_SLICE_ADDR, number);
    uint32_t found = get(bus, PLENOFIR_SLICE_SHIFT_ADDR);
    if ((found & PLENOFIR_SLICE_SHIFT_SHIFT_MASK) == wanted) break;
  }
  if (number == slices) return -2;

  uint32_t size = PUT(FRAME_SIZE_COLUMNS, columns) | PUT(FRAME_SIZE_ROWS, rows);
  put(bus, PLENOFIR_CONTROL_ADDR, 0);
  put(bus, PLENOFIR_FRAME_SIZE_ADDR, size);
  if (get(bus, PLENOFIR_FRAME_SIZE_ADDR) != size) return -3;
  put(bus, PLENOFIR_SLICE_ADDR, number);
  put(bus, PLENOFIR_CONTROL_ADDR, PLENOFIR_CONTROL_ENABLE_MASK);
  return (int)number;
}

#ifdef PLENOFIR_MAIN

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>

static uint32_t mapped_read(void *context, uint32_t address) { return ((volatile uint32_t *)context)[address / 4]; }

static void mapped_write(void *context, uint32_t address, uint32_t word) {
  ((volatile uint32_t *)context)[address / 4] = word;
}

int main(int count, char **words) {
  if (count != 5) {
    fprintf(stderr, "usage: plenofir_start DEVICE COLUMNS ROWS SHIFT\n");
    return 2;
  }
  int file = open(words[1], O_RDWR | O_SYNC);
  void *memory = file < 0 ? MAP_FAILED : mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (memory == MAP_FAILED) {
    perror(words[1]);
    return 2;
  }
  struct plenofir_bus bus = {memory, mapped_read, mapped_write};
  int number = plenofir_start(&bus, (uint32_t)atoi(words[2]), (uint32_t)atoi(words[3]), atoi(words[4]));
  static const char *const faults[] = {"no refocuser of this map", "no slice of this shift", "not a size it takes"};
  if (number < 0) {
    fprintf(stderr, "%s: %s\n", words[1], faults[-number - 1]);
    return 2;
  }
  printf("slice %d\n", number);
  return 0;
}

#endif

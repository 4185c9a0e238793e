// SPDX-License-Identifier: Apache-2.0
// The registers of a core behind a bus. Built by scripts/build_registers.py from hdl/axi/registers.toml.

#ifndef PLENOFIR_REGS_H
#define PLENOFIR_REGS_H

#include <stdint.h>

// Value of register constant 'identification_value'.
#define PLENOFIR_IDENTIFICATION_VALUE (1349283430)
// Value of register constant 'map_number'.
#define PLENOFIR_MAP_NUMBER (1)

// Number of registers within this register list.
#define PLENOFIR_NUM_REGS (33u)

// Type for this register list.
typedef struct plenofir_regs_t
{
  // Mode "Read".
  uint32_t identification;
  // Mode "Read".
  uint32_t version;
  // Mode "Read".
  uint32_t parts;
  // Mode "Read".
  uint32_t geometry;
  // Mode "Read".
  uint32_t limits;
  // Mode "Read".
  uint32_t engine;
  // Mode "Read".
  uint32_t sharpness;
  // Mode "Read".
  uint32_t confidence;
  // Mode "Read".
  uint32_t resampler;
  // Mode "Read".
  uint32_t lenses;
  // Mode "Read, Write".
  uint32_t asked_slice;
  // Mode "Read".
  uint32_t slice_shift;
  // Mode "Read, Write".
  uint32_t control;
  // Mode "Write-pulse".
  uint32_t command;
  // Mode "Read, Write".
  uint32_t slice;
  // Mode "Read, Write".
  uint32_t sweep_frames;
  // Mode "Read, Write".
  uint32_t frame_size;
  // Mode "Read, Write".
  uint32_t red_place;
  // Mode "Read".
  uint32_t status;
  // Mode "Read".
  uint32_t raster_size;
  // Mode "Read, Write-pulse".
  uint32_t errors;
  // Mode "Read, Write-pulse".
  uint32_t interrupt_status;
  // Mode "Read, Write".
  uint32_t interrupt_mask;
  // Mode "Read".
  uint32_t frames_in;
  // Mode "Read".
  uint32_t frames_out;
  // Mode "Read".
  uint32_t lines_in;
  // Mode "Read".
  uint32_t lines_out;
  // Mode "Read".
  uint32_t stalls_in;
  // Mode "Read".
  uint32_t stalls_out;
  // Mode "Read".
  uint32_t dropped;
  // Mode "Read, Write-pulse".
  uint32_t load_place;
  // Mode "Read, Write".
  uint32_t load_high;
  // Mode "Write-pulse".
  uint32_t load_word;
} plenofir_regs_t;

// Address of the 'identification' register.
// Mode 'Read'.
#define PLENOFIR_IDENTIFICATION_INDEX (0u)
#define PLENOFIR_IDENTIFICATION_ADDR (4u * PLENOFIR_IDENTIFICATION_INDEX)
// Attributes for the 'number' field in the 'identification' register.
#define PLENOFIR_IDENTIFICATION_NUMBER_SHIFT (0u)
#define PLENOFIR_IDENTIFICATION_NUMBER_MASK (0xFFFFFFFFu << 0u)

// Address of the 'version' register.
// Mode 'Read'.
#define PLENOFIR_VERSION_INDEX (1u)
#define PLENOFIR_VERSION_ADDR (4u * PLENOFIR_VERSION_INDEX)
// Attributes for the 'patch' field in the 'version' register.
#define PLENOFIR_VERSION_PATCH_SHIFT (0u)
#define PLENOFIR_VERSION_PATCH_MASK (0xFFu << 0u)
// Attributes for the 'minor' field in the 'version' register.
#define PLENOFIR_VERSION_MINOR_SHIFT (8u)
#define PLENOFIR_VERSION_MINOR_MASK (0xFFu << 8u)
// Attributes for the 'major' field in the 'version' register.
#define PLENOFIR_VERSION_MAJOR_SHIFT (16u)
#define PLENOFIR_VERSION_MAJOR_MASK (0xFFu << 16u)
// Attributes for the 'map' field in the 'version' register.
#define PLENOFIR_VERSION_MAP_SHIFT (24u)
#define PLENOFIR_VERSION_MAP_MASK (0xFFu << 24u)

// Address of the 'parts' register.
// Mode 'Read'.
#define PLENOFIR_PARTS_INDEX (2u)
#define PLENOFIR_PARTS_ADDR (4u * PLENOFIR_PARTS_INDEX)
// Attributes for the 'refocuser' field in the 'parts' register.
#define PLENOFIR_PARTS_REFOCUSER_SHIFT (0u)
#define PLENOFIR_PARTS_REFOCUSER_MASK (0x1u << 0u)
// Attributes for the 'stack' field in the 'parts' register.
#define PLENOFIR_PARTS_STACK_SHIFT (1u)
#define PLENOFIR_PARTS_STACK_MASK (0x1u << 1u)
// Attributes for the 'depth_index' field in the 'parts' register.
#define PLENOFIR_PARTS_DEPTH_INDEX_SHIFT (2u)
#define PLENOFIR_PARTS_DEPTH_INDEX_MASK (0x1u << 2u)
// Attributes for the 'resampler' field in the 'parts' register.
#define PLENOFIR_PARTS_RESAMPLER_SHIFT (3u)
#define PLENOFIR_PARTS_RESAMPLER_MASK (0x1u << 3u)
// Attributes for the 'mosaic' field in the 'parts' register.
#define PLENOFIR_PARTS_MOSAIC_SHIFT (4u)
#define PLENOFIR_PARTS_MOSAIC_MASK (0x1u << 4u)

// Address of the 'geometry' register.
// Mode 'Read'.
#define PLENOFIR_GEOMETRY_INDEX (3u)
#define PLENOFIR_GEOMETRY_ADDR (4u * PLENOFIR_GEOMETRY_INDEX)
// Attributes for the 'micro_image_size' field in the 'geometry' register.
#define PLENOFIR_GEOMETRY_MICRO_IMAGE_SIZE_SHIFT (0u)
#define PLENOFIR_GEOMETRY_MICRO_IMAGE_SIZE_MASK (0xFFu << 0u)
// Attributes for the 'slices' field in the 'geometry' register.
#define PLENOFIR_GEOMETRY_SLICES_SHIFT (8u)
#define PLENOFIR_GEOMETRY_SLICES_MASK (0x1FFu << 8u)
// Attributes for the 'channels' field in the 'geometry' register.
#define PLENOFIR_GEOMETRY_CHANNELS_SHIFT (17u)
#define PLENOFIR_GEOMETRY_CHANNELS_MASK (0x3u << 17u)
// Attributes for the 'pixel_bits' field in the 'geometry' register.
#define PLENOFIR_GEOMETRY_PIXEL_BITS_SHIFT (19u)
#define PLENOFIR_GEOMETRY_PIXEL_BITS_MASK (0x1Fu << 19u)
// Attributes for the 'pixels_per_clock' field in the 'geometry' register.
#define PLENOFIR_GEOMETRY_PIXELS_PER_CLOCK_SHIFT (24u)
#define PLENOFIR_GEOMETRY_PIXELS_PER_CLOCK_MASK (0x3Fu << 24u)

// Address of the 'limits' register.
// Mode 'Read'.
#define PLENOFIR_LIMITS_INDEX (4u)
#define PLENOFIR_LIMITS_ADDR (4u * PLENOFIR_LIMITS_INDEX)
// Attributes for the 'max_columns' field in the 'limits' register.
#define PLENOFIR_LIMITS_MAX_COLUMNS_SHIFT (0u)
#define PLENOFIR_LIMITS_MAX_COLUMNS_MASK (0xFFFFu << 0u)
// Attributes for the 'parallel_rows' field in the 'limits' register.
#define PLENOFIR_LIMITS_PARALLEL_ROWS_SHIFT (16u)
#define PLENOFIR_LIMITS_PARALLEL_ROWS_MASK (0x7Fu << 16u)

// Address of the 'engine' register.
// Mode 'Read'.
#define PLENOFIR_ENGINE_INDEX (5u)
#define PLENOFIR_ENGINE_ADDR (4u * PLENOFIR_ENGINE_INDEX)
// Attributes for the 'moving_sum' field in the 'engine' register.
#define PLENOFIR_ENGINE_MOVING_SUM_SHIFT (0u)
#define PLENOFIR_ENGINE_MOVING_SUM_MASK (0x1u << 0u)
// Attributes for the 'exact' field in the 'engine' register.
#define PLENOFIR_ENGINE_EXACT_SHIFT (1u)
#define PLENOFIR_ENGINE_EXACT_MASK (0x1u << 1u)
// Attributes for the 'centred' field in the 'engine' register.
#define PLENOFIR_ENGINE_CENTRED_SHIFT (2u)
#define PLENOFIR_ENGINE_CENTRED_MASK (0x1u << 2u)
// Attributes for the 'hold' field in the 'engine' register.
#define PLENOFIR_ENGINE_HOLD_SHIFT (3u)
#define PLENOFIR_ENGINE_HOLD_MASK (0x1u << 3u)
// Attributes for the 'any_rows' field in the 'engine' register.
#define PLENOFIR_ENGINE_ANY_ROWS_SHIFT (4u)
#define PLENOFIR_ENGINE_ANY_ROWS_MASK (0x1u << 4u)
// Attributes for the 'order' field in the 'engine' register.
#define PLENOFIR_ENGINE_ORDER_SHIFT (5u)
#define PLENOFIR_ENGINE_ORDER_MASK (0x3u << 5u)
// Attributes for the 'fraction_bits' field in the 'engine' register.
#define PLENOFIR_ENGINE_FRACTION_BITS_SHIFT (7u)
#define PLENOFIR_ENGINE_FRACTION_BITS_MASK (0xFu << 7u)
// Attributes for the 'guard_bits' field in the 'engine' register.
#define PLENOFIR_ENGINE_GUARD_BITS_SHIFT (11u)
#define PLENOFIR_ENGINE_GUARD_BITS_MASK (0xFu << 11u)
// Attributes for the 'border_normalised' field in the 'engine' register.
#define PLENOFIR_ENGINE_BORDER_NORMALISED_SHIFT (15u)
#define PLENOFIR_ENGINE_BORDER_NORMALISED_MASK (0x1u << 15u)

// Address of the 'sharpness' register.
// Mode 'Read'.
#define PLENOFIR_SHARPNESS_INDEX (6u)
#define PLENOFIR_SHARPNESS_ADDR (4u * PLENOFIR_SHARPNESS_INDEX)
// Attributes for the 'radius' field in the 'sharpness' register.
#define PLENOFIR_SHARPNESS_RADIUS_SHIFT (0u)
#define PLENOFIR_SHARPNESS_RADIUS_MASK (0xFu << 0u)
// Attributes for the 'vote_radius' field in the 'sharpness' register.
#define PLENOFIR_SHARPNESS_VOTE_RADIUS_SHIFT (4u)
#define PLENOFIR_SHARPNESS_VOTE_RADIUS_MASK (0x7u << 4u)
// Attributes for the 'sharp_too' field in the 'sharpness' register.
#define PLENOFIR_SHARPNESS_SHARP_TOO_SHIFT (7u)
#define PLENOFIR_SHARPNESS_SHARP_TOO_MASK (0x1u << 7u)

// Address of the 'confidence' register.
// Mode 'Read'.
#define PLENOFIR_CONFIDENCE_INDEX (7u)
#define PLENOFIR_CONFIDENCE_ADDR (4u * PLENOFIR_CONFIDENCE_INDEX)
// Attributes for the 'level' field in the 'confidence' register.
#define PLENOFIR_CONFIDENCE_LEVEL_SHIFT (0u)
#define PLENOFIR_CONFIDENCE_LEVEL_MASK (0x3FFFFFFFu << 0u)

// Address of the 'resampler' register.
// Mode 'Read'.
#define PLENOFIR_RESAMPLER_INDEX (8u)
#define PLENOFIR_RESAMPLER_ADDR (4u * PLENOFIR_RESAMPLER_INDEX)
// Attributes for the 'hexagonal' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_HEXAGONAL_SHIFT (0u)
#define PLENOFIR_RESAMPLER_HEXAGONAL_MASK (0x1u << 0u)
// Attributes for the 'moves' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_MOVES_SHIFT (1u)
#define PLENOFIR_RESAMPLER_MOVES_MASK (0x1u << 1u)
// Attributes for the 'gains' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_GAINS_SHIFT (2u)
#define PLENOFIR_RESAMPLER_GAINS_MASK (0x1u << 2u)
// Attributes for the 'lines' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_LINES_SHIFT (3u)
#define PLENOFIR_RESAMPLER_LINES_MASK (0x1FFu << 3u)
// Attributes for the 'fraction_bits' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_FRACTION_BITS_SHIFT (12u)
#define PLENOFIR_RESAMPLER_FRACTION_BITS_MASK (0x1Fu << 12u)
// Attributes for the 'weight_bits' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_WEIGHT_BITS_SHIFT (17u)
#define PLENOFIR_RESAMPLER_WEIGHT_BITS_MASK (0xFu << 17u)
// Attributes for the 'guard_bits' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_GUARD_BITS_SHIFT (21u)
#define PLENOFIR_RESAMPLER_GUARD_BITS_MASK (0x3u << 21u)
// Attributes for the 'gain_bits' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_GAIN_BITS_SHIFT (23u)
#define PLENOFIR_RESAMPLER_GAIN_BITS_MASK (0xFu << 23u)
// Attributes for the 'skewed' field in the 'resampler' register.
#define PLENOFIR_RESAMPLER_SKEWED_SHIFT (27u)
#define PLENOFIR_RESAMPLER_SKEWED_MASK (0x1u << 27u)

// Address of the 'lenses' register.
// Mode 'Read'.
#define PLENOFIR_LENSES_INDEX (9u)
#define PLENOFIR_LENSES_ADDR (4u * PLENOFIR_LENSES_INDEX)
// Attributes for the 'count' field in the 'lenses' register.
#define PLENOFIR_LENSES_COUNT_SHIFT (0u)
#define PLENOFIR_LENSES_COUNT_MASK (0x1FFFFFu << 0u)

// Address of the 'asked_slice' register.
// Mode 'Read, Write'.
#define PLENOFIR_ASKED_SLICE_INDEX (10u)
#define PLENOFIR_ASKED_SLICE_ADDR (4u * PLENOFIR_ASKED_SLICE_INDEX)
// Attributes for the 'number' field in the 'asked_slice' register.
#define PLENOFIR_ASKED_SLICE_NUMBER_SHIFT (0u)
#define PLENOFIR_ASKED_SLICE_NUMBER_MASK (0xFFu << 0u)

// Address of the 'slice_shift' register.
// Mode 'Read'.
#define PLENOFIR_SLICE_SHIFT_INDEX (11u)
#define PLENOFIR_SLICE_SHIFT_ADDR (4u * PLENOFIR_SLICE_SHIFT_INDEX)
// Attributes for the 'shift' field in the 'slice_shift' register.
#define PLENOFIR_SLICE_SHIFT_SHIFT_SHIFT (0u)
#define PLENOFIR_SLICE_SHIFT_SHIFT_MASK (0x3FFFu << 0u)
// Attributes for the 'sharpening' field in the 'slice_shift' register.
#define PLENOFIR_SLICE_SHIFT_SHARPENING_SHIFT (14u)
#define PLENOFIR_SLICE_SHIFT_SHARPENING_MASK (0x1Fu << 14u)
// Attributes for the 'box' field in the 'slice_shift' register.
#define PLENOFIR_SLICE_SHIFT_BOX_SHIFT (19u)
#define PLENOFIR_SLICE_SHIFT_BOX_MASK (0xFFu << 19u)

// Address of the 'control' register.
// Mode 'Read, Write'.
#define PLENOFIR_CONTROL_INDEX (12u)
#define PLENOFIR_CONTROL_ADDR (4u * PLENOFIR_CONTROL_INDEX)
// Attributes for the 'enable' field in the 'control' register.
#define PLENOFIR_CONTROL_ENABLE_SHIFT (0u)
#define PLENOFIR_CONTROL_ENABLE_MASK (0x1u << 0u)
// Attributes for the 'sweep' field in the 'control' register.
#define PLENOFIR_CONTROL_SWEEP_SHIFT (1u)
#define PLENOFIR_CONTROL_SWEEP_MASK (0x1u << 1u)

// Address of the 'command' register.
// Mode 'Write-pulse'.
#define PLENOFIR_COMMAND_INDEX (13u)
#define PLENOFIR_COMMAND_ADDR (4u * PLENOFIR_COMMAND_INDEX)
// Attributes for the 'restart' field in the 'command' register.
#define PLENOFIR_COMMAND_RESTART_SHIFT (0u)
#define PLENOFIR_COMMAND_RESTART_MASK (0x1u << 0u)
// Attributes for the 'commit' field in the 'command' register.
#define PLENOFIR_COMMAND_COMMIT_SHIFT (1u)
#define PLENOFIR_COMMAND_COMMIT_MASK (0x1u << 1u)

// Address of the 'slice' register.
// Mode 'Read, Write'.
#define PLENOFIR_SLICE_INDEX (14u)
#define PLENOFIR_SLICE_ADDR (4u * PLENOFIR_SLICE_INDEX)
// Attributes for the 'number' field in the 'slice' register.
#define PLENOFIR_SLICE_NUMBER_SHIFT (0u)
#define PLENOFIR_SLICE_NUMBER_MASK (0xFFu << 0u)

// Address of the 'sweep_frames' register.
// Mode 'Read, Write'.
#define PLENOFIR_SWEEP_FRAMES_INDEX (15u)
#define PLENOFIR_SWEEP_FRAMES_ADDR (4u * PLENOFIR_SWEEP_FRAMES_INDEX)
// Attributes for the 'count' field in the 'sweep_frames' register.
#define PLENOFIR_SWEEP_FRAMES_COUNT_SHIFT (0u)
#define PLENOFIR_SWEEP_FRAMES_COUNT_MASK (0xFFu << 0u)

// Address of the 'frame_size' register.
// Mode 'Read, Write'.
#define PLENOFIR_FRAME_SIZE_INDEX (16u)
#define PLENOFIR_FRAME_SIZE_ADDR (4u * PLENOFIR_FRAME_SIZE_INDEX)
// Attributes for the 'columns' field in the 'frame_size' register.
#define PLENOFIR_FRAME_SIZE_COLUMNS_SHIFT (0u)
#define PLENOFIR_FRAME_SIZE_COLUMNS_MASK (0xFFFFu << 0u)
// Attributes for the 'rows' field in the 'frame_size' register.
#define PLENOFIR_FRAME_SIZE_ROWS_SHIFT (16u)
#define PLENOFIR_FRAME_SIZE_ROWS_MASK (0xFFFFu << 16u)

// Address of the 'red_place' register.
// Mode 'Read, Write'.
#define PLENOFIR_RED_PLACE_INDEX (17u)
#define PLENOFIR_RED_PLACE_ADDR (4u * PLENOFIR_RED_PLACE_INDEX)
// Attributes for the 'column' field in the 'red_place' register.
#define PLENOFIR_RED_PLACE_COLUMN_SHIFT (0u)
#define PLENOFIR_RED_PLACE_COLUMN_MASK (0x1u << 0u)
// Attributes for the 'row' field in the 'red_place' register.
#define PLENOFIR_RED_PLACE_ROW_SHIFT (1u)
#define PLENOFIR_RED_PLACE_ROW_MASK (0x1u << 1u)

// Address of the 'status' register.
// Mode 'Read'.
#define PLENOFIR_STATUS_INDEX (18u)
#define PLENOFIR_STATUS_ADDR (4u * PLENOFIR_STATUS_INDEX)
// Attributes for the 'slice' field in the 'status' register.
#define PLENOFIR_STATUS_SLICE_SHIFT (0u)
#define PLENOFIR_STATUS_SLICE_MASK (0xFFu << 0u)
// Attributes for the 'inside' field in the 'status' register.
#define PLENOFIR_STATUS_INSIDE_SHIFT (8u)
#define PLENOFIR_STATUS_INSIDE_MASK (0x1u << 8u)

// Address of the 'raster_size' register.
// Mode 'Read'.
#define PLENOFIR_RASTER_SIZE_INDEX (19u)
#define PLENOFIR_RASTER_SIZE_ADDR (4u * PLENOFIR_RASTER_SIZE_INDEX)
// Attributes for the 'columns' field in the 'raster_size' register.
#define PLENOFIR_RASTER_SIZE_COLUMNS_SHIFT (0u)
#define PLENOFIR_RASTER_SIZE_COLUMNS_MASK (0xFFFFu << 0u)
// Attributes for the 'rows' field in the 'raster_size' register.
#define PLENOFIR_RASTER_SIZE_ROWS_SHIFT (16u)
#define PLENOFIR_RASTER_SIZE_ROWS_MASK (0xFFFFu << 16u)

// Address of the 'errors' register.
// Mode 'Read, Write-pulse'.
#define PLENOFIR_ERRORS_INDEX (20u)
#define PLENOFIR_ERRORS_ADDR (4u * PLENOFIR_ERRORS_INDEX)
// Attributes for the 'line_early' field in the 'errors' register.
#define PLENOFIR_ERRORS_LINE_EARLY_SHIFT (0u)
#define PLENOFIR_ERRORS_LINE_EARLY_MASK (0x1u << 0u)
// Attributes for the 'line_late' field in the 'errors' register.
#define PLENOFIR_ERRORS_LINE_LATE_SHIFT (1u)
#define PLENOFIR_ERRORS_LINE_LATE_MASK (0x1u << 1u)
// Attributes for the 'frame_early' field in the 'errors' register.
#define PLENOFIR_ERRORS_FRAME_EARLY_SHIFT (2u)
#define PLENOFIR_ERRORS_FRAME_EARLY_MASK (0x1u << 2u)
// Attributes for the 'frame_late' field in the 'errors' register.
#define PLENOFIR_ERRORS_FRAME_LATE_SHIFT (3u)
#define PLENOFIR_ERRORS_FRAME_LATE_MASK (0x1u << 3u)
// Attributes for the 'frame_size' field in the 'errors' register.
#define PLENOFIR_ERRORS_FRAME_SIZE_SHIFT (4u)
#define PLENOFIR_ERRORS_FRAME_SIZE_MASK (0x1u << 4u)
// Attributes for the 'calibration' field in the 'errors' register.
#define PLENOFIR_ERRORS_CALIBRATION_SHIFT (5u)
#define PLENOFIR_ERRORS_CALIBRATION_MASK (0x1u << 5u)
// Attributes for the 'refused' field in the 'errors' register.
#define PLENOFIR_ERRORS_REFUSED_SHIFT (6u)
#define PLENOFIR_ERRORS_REFUSED_MASK (0x1u << 6u)

// Address of the 'interrupt_status' register.
// Mode 'Read, Write-pulse'.
#define PLENOFIR_INTERRUPT_STATUS_INDEX (21u)
#define PLENOFIR_INTERRUPT_STATUS_ADDR (4u * PLENOFIR_INTERRUPT_STATUS_INDEX)
// Attributes for the 'frame_in' field in the 'interrupt_status' register.
#define PLENOFIR_INTERRUPT_STATUS_FRAME_IN_SHIFT (0u)
#define PLENOFIR_INTERRUPT_STATUS_FRAME_IN_MASK (0x1u << 0u)
// Attributes for the 'frame_out' field in the 'interrupt_status' register.
#define PLENOFIR_INTERRUPT_STATUS_FRAME_OUT_SHIFT (1u)
#define PLENOFIR_INTERRUPT_STATUS_FRAME_OUT_MASK (0x1u << 1u)
// Attributes for the 'error' field in the 'interrupt_status' register.
#define PLENOFIR_INTERRUPT_STATUS_ERROR_SHIFT (2u)
#define PLENOFIR_INTERRUPT_STATUS_ERROR_MASK (0x1u << 2u)

// Address of the 'interrupt_mask' register.
// Mode 'Read, Write'.
#define PLENOFIR_INTERRUPT_MASK_INDEX (22u)
#define PLENOFIR_INTERRUPT_MASK_ADDR (4u * PLENOFIR_INTERRUPT_MASK_INDEX)
// Attributes for the 'frame_in' field in the 'interrupt_mask' register.
#define PLENOFIR_INTERRUPT_MASK_FRAME_IN_SHIFT (0u)
#define PLENOFIR_INTERRUPT_MASK_FRAME_IN_MASK (0x1u << 0u)
// Attributes for the 'frame_out' field in the 'interrupt_mask' register.
#define PLENOFIR_INTERRUPT_MASK_FRAME_OUT_SHIFT (1u)
#define PLENOFIR_INTERRUPT_MASK_FRAME_OUT_MASK (0x1u << 1u)
// Attributes for the 'error' field in the 'interrupt_mask' register.
#define PLENOFIR_INTERRUPT_MASK_ERROR_SHIFT (2u)
#define PLENOFIR_INTERRUPT_MASK_ERROR_MASK (0x1u << 2u)

// Address of the 'frames_in' register.
// Mode 'Read'.
#define PLENOFIR_FRAMES_IN_INDEX (23u)
#define PLENOFIR_FRAMES_IN_ADDR (4u * PLENOFIR_FRAMES_IN_INDEX)
// Attributes for the 'count' field in the 'frames_in' register.
#define PLENOFIR_FRAMES_IN_COUNT_SHIFT (0u)
#define PLENOFIR_FRAMES_IN_COUNT_MASK (0xFFFFFFFFu << 0u)

// Address of the 'frames_out' register.
// Mode 'Read'.
#define PLENOFIR_FRAMES_OUT_INDEX (24u)
#define PLENOFIR_FRAMES_OUT_ADDR (4u * PLENOFIR_FRAMES_OUT_INDEX)
// Attributes for the 'count' field in the 'frames_out' register.
#define PLENOFIR_FRAMES_OUT_COUNT_SHIFT (0u)
#define PLENOFIR_FRAMES_OUT_COUNT_MASK (0xFFFFFFFFu << 0u)

// Address of the 'lines_in' register.
// Mode 'Read'.
#define PLENOFIR_LINES_IN_INDEX (25u)
#define PLENOFIR_LINES_IN_ADDR (4u * PLENOFIR_LINES_IN_INDEX)
// Attributes for the 'count' field in the 'lines_in' register.
#define PLENOFIR_LINES_IN_COUNT_SHIFT (0u)
#define PLENOFIR_LINES_IN_COUNT_MASK (0xFFFFFFFFu << 0u)

// Address of the 'lines_out' register.
// Mode 'Read'.
#define PLENOFIR_LINES_OUT_INDEX (26u)
#define PLENOFIR_LINES_OUT_ADDR (4u * PLENOFIR_LINES_OUT_INDEX)
// Attributes for the 'count' field in the 'lines_out' register.
#define PLENOFIR_LINES_OUT_COUNT_SHIFT (0u)
#define PLENOFIR_LINES_OUT_COUNT_MASK (0xFFFFFFFFu << 0u)

// Address of the 'stalls_in' register.
// Mode 'Read'.
#define PLENOFIR_STALLS_IN_INDEX (27u)
#define PLENOFIR_STALLS_IN_ADDR (4u * PLENOFIR_STALLS_IN_INDEX)
// Attributes for the 'count' field in the 'stalls_in' register.
#define PLENOFIR_STALLS_IN_COUNT_SHIFT (0u)
#define PLENOFIR_STALLS_IN_COUNT_MASK (0xFFFFFFFFu << 0u)

// Address of the 'stalls_out' register.
// Mode 'Read'.
#define PLENOFIR_STALLS_OUT_INDEX (28u)
#define PLENOFIR_STALLS_OUT_ADDR (4u * PLENOFIR_STALLS_OUT_INDEX)
// Attributes for the 'count' field in the 'stalls_out' register.
#define PLENOFIR_STALLS_OUT_COUNT_SHIFT (0u)
#define PLENOFIR_STALLS_OUT_COUNT_MASK (0xFFFFFFFFu << 0u)

// Address of the 'dropped' register.
// Mode 'Read'.
#define PLENOFIR_DROPPED_INDEX (29u)
#define PLENOFIR_DROPPED_ADDR (4u * PLENOFIR_DROPPED_INDEX)
// Attributes for the 'count' field in the 'dropped' register.
#define PLENOFIR_DROPPED_COUNT_SHIFT (0u)
#define PLENOFIR_DROPPED_COUNT_MASK (0xFFFFFFFFu << 0u)

// Address of the 'load_place' register.
// Mode 'Read, Write-pulse'.
#define PLENOFIR_LOAD_PLACE_INDEX (30u)
#define PLENOFIR_LOAD_PLACE_ADDR (4u * PLENOFIR_LOAD_PLACE_INDEX)
// Attributes for the 'address' field in the 'load_place' register.
#define PLENOFIR_LOAD_PLACE_ADDRESS_SHIFT (0u)
#define PLENOFIR_LOAD_PLACE_ADDRESS_MASK (0xFFFFFu << 0u)
// Attributes for the 'kind' field in the 'load_place' register.
#define PLENOFIR_LOAD_PLACE_KIND_SHIFT (20u)
#define PLENOFIR_LOAD_PLACE_KIND_MASK (0x3u << 20u)
enum PlenofirLoadPlaceKind
{
  PLENOFIR_LOAD_PLACE_KIND_GRID = 0,
  PLENOFIR_LOAD_PLACE_KIND_LENS = 1,
  PLENOFIR_LOAD_PLACE_KIND_PROFILE = 2,
};

// Address of the 'load_high' register.
// Mode 'Read, Write'.
#define PLENOFIR_LOAD_HIGH_INDEX (31u)
#define PLENOFIR_LOAD_HIGH_ADDR (4u * PLENOFIR_LOAD_HIGH_INDEX)
// Attributes for the 'bits' field in the 'load_high' register.
#define PLENOFIR_LOAD_HIGH_BITS_SHIFT (0u)
#define PLENOFIR_LOAD_HIGH_BITS_MASK (0xFFu << 0u)

// Address of the 'load_word' register.
// Mode 'Write-pulse'.
#define PLENOFIR_LOAD_WORD_INDEX (32u)
#define PLENOFIR_LOAD_WORD_ADDR (4u * PLENOFIR_LOAD_WORD_INDEX)
// Attributes for the 'low' field in the 'load_word' register.
#define PLENOFIR_LOAD_WORD_LOW_SHIFT (0u)
#define PLENOFIR_LOAD_WORD_LOW_MASK (0xFFFFFFFFu << 0u)

#endif // PLENOFIR_REGS_H


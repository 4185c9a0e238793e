-- SPDX-License-Identifier: Apache-2.0
-- Bits of the faults that cores and video paths report.

package fault_pkg is

  -- Faults of a stream of frames: a line ends early, or late; a frame starts within a frame; pixels come without a
  -- start of frame; the frame size is not supported.
  constant LINE_EARLY        : natural  := 0;
  constant LINE_LATE         : natural  := 1;
  constant FRAME_EARLY       : natural  := 2;
  constant STRAY_PIXELS      : natural  := 3;
  constant FRAME_SIZE        : natural  := 4;
  constant STREAM_FAULT_BITS : positive := 5;

  -- Errors of a video path: a pixel was lost at the core's input; a pixel was missing at its output; a frame began
  -- elsewhere than expected; the core or the sensor's resampler has a fault, or the raster is larger than the frame.
  constant PIXEL_LOST       : natural  := 0;
  constant PIXEL_MISSING    : natural  := 1;
  constant FRAME_MOVED      : natural  := 2;
  constant CORE_FAULT       : natural  := 3;
  constant VIDEO_ERROR_BITS : positive := 4;

  -- Errors of a board: those of its video path, and words that no encoder sends.
  constant WRONG_WORD : natural  := VIDEO_ERROR_BITS;
  constant ERRORS     : positive := VIDEO_ERROR_BITS + 1;

end package fault_pkg;

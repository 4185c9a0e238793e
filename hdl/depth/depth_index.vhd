-- SPDX-License-Identifier: Apache-2.0
-- Depth index and all-in-focus picture of a focal stack, while it streams.
--
-- The entity makes the index from its generics; stack_index is a stream shell around sharpness_index, which finds the
-- slice of largest local sharpness for each micro image and takes all of its pixels from there. The output may also
-- have the depth between slices, and the pixel of a slice that was chosen for the frame. When nothing follows, the core
-- pushes the rest of the frame out by itself, in lines up to a multiple of M; a frame that arrives meanwhile waits in
-- the source.
--
-- Latency: sharpness_delay lines and index_latency + 7 clocks when nothing stalls.
-- Throughput: PIXELS_PER_CLOCK pixels of all slices each clock.
-- Equation: that of sharpness_index.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;
use work.token_pkg.all;

entity depth_index is
  generic (
    -- M: pixels a micro image in each dimension.
    MICRO_IMAGE_SIZE : positive range 2 to 128;
    -- Slices of the stack.
    SLICES : positive range 1 to 256;
    -- RADIUS of the window that sharpness is judged in: (2 RADIUS + 1) x (2 RADIUS + 1) micro images.
    RADIUS : natural range 0 to 8 := 1;
    -- CONFIDENCE: least difference of sharpness between the sharpest and the dullest slice of a micro image with
    -- texture. VOTE_RADIUS: radius of the window of micro images that vote for the others; with 0 every micro image
    -- keeps its own slice.
    CONFIDENCE  : natural range 0 to 1073741823 := 0;
    VOTE_RADIUS : natural range 0 to 4          := 0;
    -- The shifts of the slices as in focal_stack, ascending or descending, to get the depth between slices; "": no
    -- depth.
    SHIFTS : string := "";
    -- Longest line in pixels.
    MAX_COLUMNS : positive range 1 to 8192 := 2048;
    -- Neighbouring pixels of a line in one transfer, as in focal_stack; at most M.
    PIXELS_PER_CLOCK : positive range 1 to 32 := 1;
    -- 1 (grey) or 3 (RGB).
    CHANNELS : positive range 1 to 3 := 1;
    -- Width of a channel.
    PIXEL_BITS : positive range 1 to 16 := 8;
    -- true: the picture comes out, and the pixels of all slices wait in a ring of lines inside; false: only the depth
    -- of each pixel comes out, and there is no ring of lines.
    PICTURE : boolean := true;
    -- true: the pixel of a chosen slice goes beside the picture.
    CHOSEN_TOO : boolean := false;
    -- true: each slice comes twice, with its box of M samples and above it with a smaller one. The smaller one comes
    -- out where a micro image has texture (CONFIDENCE): of its sharpest slice in the picture, of the chosen slice where
    -- that is the sharpest.
    SHARP_TOO : boolean := false;
    -- true: the entity pushes the rest of a frame out when nothing follows. false: the next frame does, and frames may
    -- have lines below the picture, see picture_rows.
    FLUSH : boolean := true
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Frame size, read with the first pixel of a frame.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Without FLUSH: lines of the picture, constant while it streams. Lines below it in a frame count as beyond the
    -- edge and do not come out.
    picture_rows : in    std_logic_vector(15 downto 0);
    -- The slice of the next frame as a number in the set; numbers beyond the set mean its last slice. With sweep all
    -- slices come in turn, each for sweep_frames frames (0 counts as 1). All three are read with the first pixel of a
    -- frame, and used with CHOSEN_TOO only.
    slice        : in    std_logic_vector(7 downto 0);
    sweep        : in    std_logic;
    sweep_frames : in    std_logic_vector(7 downto 0);
    -- AXI4-Stream video, packed as focal_stack's m_axis; pixels behind a line's last one count as zero.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(PIXELS_PER_CLOCK * SLICES * choose(SHARP_TOO, 2, 1) * CHANNELS *
                                                PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- The picture. tdata of a pixel, from the low bits: with PICTURE the pixel, channel 0 lowest; 8 bits of the index;
    -- with SHIFTS 8 bits of the place between slices and 8 bits of its confidence (depth_fraction); with CHOSEN_TOO the
    -- pixel of slice tid. The next pixel's data follow; zeros behind a line's last pixel.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(PIXELS_PER_CLOCK * index_word_bits(CHANNELS, PIXEL_BITS, SHIFTS,
                                                                                  CHOSEN_TOO, PICTURE) - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Faults of the stream by the bits of fault_pkg; they stay set until error_clear.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic
  );
end entity depth_index;

architecture rtl of depth_index is

  constant BUILD : index_build_t := index_of
                                    (
                                      name             => "depth_index",
                                      micro_image_size => MICRO_IMAGE_SIZE,
                                      slices           => SLICES,
                                      shifts           => ordered_shifts("depth_index", SHIFTS, SLICES),
                                      between          => SHIFTS'length > 0,
                                      radius           => RADIUS,
                                      confidence       => CONFIDENCE,
                                      vote_radius      => VOTE_RADIUS,
                                      max_columns      => MAX_COLUMNS,
                                      pixels           => PIXELS_PER_CLOCK,
                                      channels         => CHANNELS,
                                      pixel_bits       => PIXEL_BITS,
                                      cropped          => not FLUSH,
                                      picture          => PICTURE,
                                      chosen_too       => CHOSEN_TOO,
                                      boxes            => choose(SHARP_TOO, 2, 1)
                                    );

  signal order   : frame_order_t;
  signal s_marks : marks_t;
  signal m_marks : marks_t;

begin

  order   <=
  (
    columns      => columns,
    rows         => rows,
    slice        => slice,
    sweep        => sweep,
    sweep_frames => sweep_frames
  );
  s_marks <= (s_axis_tvalid, s_axis_tuser, s_axis_tlast);

  m_axis_tvalid <= m_marks.tvalid;
  m_axis_tuser  <= m_marks.tuser;
  m_axis_tlast  <= m_marks.tlast;

  planned : entity work.stack_index
    generic map (
      BUILD => BUILD
    )
    port map (
      clk           => clk,
      reset         => reset,
      order         => order,
      picture_rows  => picture_rows,
      s_axis_marks  => s_marks,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      m_axis_marks  => m_marks,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tid    => m_axis_tid,
      error_flags   => error_flags,
      error_clear   => error_clear
    );

end architecture rtl;

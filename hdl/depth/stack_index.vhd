-- SPDX-License-Identifier: Apache-2.0
-- The stream shell around sharpness_index: a stack of slices in, the index of the sharpest one and the picture out.
--
-- What users instantiate (depth_index) makes the record from its generics and instantiates this entity.
--
-- Latency: sharpness_delay lines and index_latency + 7 clocks when nothing stalls. Throughput: one token each clock.
-- Equation: that of sharpness_index.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.math_pkg.all;
use work.index_pkg.all;
use work.token_pkg.all;

entity stack_index is
  generic (
    BUILD : index_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Size of the next frame; its slice, if that comes out beside the picture.
    order : in    frame_order_t;
    -- With BUILD.cropped: lines of the picture, as in depth_index.
    picture_rows : in    std_logic_vector(15 downto 0);
    -- The stack.
    s_axis_marks  : in    marks_t;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(token_bits(BUILD) - 1 downto 0);
    -- The picture, packed as in depth_index.
    m_axis_marks  : out   marks_t;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(out_bits(BUILD) - 1 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    -- Faults of the stream, as in stream_shell.
    error_flags : out   std_logic_vector(4 downto 0);
    error_clear : in    std_logic
  );
end entity stack_index;

architecture rtl of stack_index is

  -- Tokens that the shell makes of the stream, and their results.
  signal token      : token_t;
  signal token_data : std_logic_vector(token_bits(BUILD) - 1 downto 0);
  signal line_end   : std_logic_vector(BUILD.pixels - 1 downto 0);
  signal results    : results_t(0 to 0);
  signal found_data : std_logic_vector(out_bits(BUILD) - 1 downto 0);

begin

  shell : entity work.stream_shell
    generic map (
      MAX_COLUMNS      => BUILD.columns,
      PIXELS_PER_CLOCK => BUILD.pixels,
      IN_BITS          => token_bits(BUILD),
      OUT_BITS         => out_bits(BUILD),
      SLICES           => choose(BUILD.chosen_too, BUILD.slices, 0),
      -- Frames with lines below the picture push each other out.
      COLUMN_DELAY   => choose(BUILD.cropped, 0, BUILD.ring_lines),
      ENGINE_LATENCY => BUILD.index_latency + 4,
      -- A scan with all its votes ends before the next scan begins.
      MIN_STEPS    => choose(BUILD.vote_radius = 0, 8 + BUILD.radius, BUILD.index_latency),
      BAND_MODULUS => BUILD.micro_image_size,
      KEEP_MODULUS => true
    )
    port map (
      clk           => clk,
      reset         => reset,
      order         => order,
      s_axis_marks  => s_axis_marks,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      m_axis_marks  => m_axis_marks,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tid    => m_axis_tid,
      error_flags   => error_flags,
      error_clear   => error_clear,
      token         => token,
      token_data    => token_data,
      line_end      => line_end,
      results       => results,
      result_data   => found_data
    );

  -- A row of micro images is judged when it is complete, so pixels wait here instead of in the shell. Only lines that
  -- are too short slow the source down.
  find : entity work.sharpness_index
    generic map (
      BUILD => BUILD
    )
    port map (
      clk        => clk,
      reset      => reset,
      rows       => picture_rows,
      token      => token,
      token_data => token_data,
      line_end   => line_end,
      result     => results(0),
      out_data   => found_data
    );

end architecture rtl;

-- SPDX-License-Identifier: Apache-2.0
-- An example design in VHDL around the core: a button chooses the slice.
--
-- The generics are those that `plenofir plan grey-microscope` finds: M = 5, a = -1, 0 and 1, lines of up to 1000 grey
-- pixels. Frame size is set at run time. Each press of the button takes the next slice; it takes effect with the next
-- frame. Streams are AXI4-Stream video.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity refocus_button is
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Frame size, read with the first pixel of a frame; rows are a multiple of M.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Already debounced; may change at any time.
    button : in    std_logic;
    -- tuser(0) = start of frame, tlast = end of line.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(7 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- The same; tid = the slice that the frame was refocused to.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(7 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tlast  : out   std_logic;
    -- Set by broken frames until reset.
    error_flags : out   std_logic_vector(4 downto 0)
  );
end entity refocus_button;

architecture rtl of refocus_button is

  constant SLICES : positive := 3;

  -- Two registers against metastability, one to see the edge.
  signal pressed : std_logic_vector(2 downto 0) := "000";
  signal slice   : unsigned(7 downto 0)         := x"00";

begin

  choose_slice : process (clk) is
  begin

    if rising_edge(clk) then
      pressed <= pressed(1 downto 0) & button;
      if reset = '1' then
        slice <= x"00";
      elsif pressed(1) = '1' and pressed(2) = '0' then
        if slice = SLICES - 1 then
          slice <= x"00";
        else
          slice <= slice + 1;
        end if;
      end if;
    end if;

  end process choose_slice;

  core : entity work.raster_refocuser
    generic map (
      MICRO_IMAGE_SIZE => 5,
      SHIFTS           => "-5 0 5",
      MAX_COLUMNS      => 1000,
      CHANNELS         => 1,
      PIXEL_BITS       => 8,
      ENGINE           => "moving_sum"
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns,
      rows          => rows,
      slice         => std_logic_vector(slice),
      sweep         => '0',
      sweep_frames  => x"00",
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      s_axis_tuser  => s_axis_tuser,
      s_axis_tlast  => s_axis_tlast,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_tuser,
      m_axis_tid    => m_axis_tid,
      m_axis_tlast  => m_axis_tlast,
      error_flags   => error_flags,
      error_clear   => '0'
    );

end architecture rtl;

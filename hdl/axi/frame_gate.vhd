-- SPDX-License-Identifier: Apache-2.0
-- Lets whole frames into a core, or drops them, and tells what goes in and comes out for counters.
--
-- A frame goes in if `enable` is high at its first pixel. What belongs to no frame (of one that is not let in, of a
-- size that the core does not support, in excess of a line, between two frames) is told in `dropped`, whether it is
-- dropped here or by frame_sequencer in the core. So the lines that are told to begin to go in are those that come out.
--
-- Latency: none for the stream, 1 clock for what is told. Throughput: one transfer each clock.
-- Equation: transfers in = those of frames + dropped.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity frame_gate is
  generic (
    -- Longest line of the core in pixels.
    MAX_COLUMNS : positive range 1 to 8192;
    -- Pixels that come together.
    PIXELS_PER_CLOCK : positive range 1 to 32
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Frames that begin are let in.
    enable : in    std_logic;
    -- Frame size of the core.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- The stream that comes, without its data.
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    -- Handshake of the core's input.
    core_tvalid : out   std_logic;
    core_tready : in    std_logic;
    -- The core's output, which is watched alone.
    m_axis_tvalid : in    std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tuser  : in    std_logic_vector(0 downto 0);
    m_axis_tlast  : in    std_logic;
    -- A frame is under way: its last pixel has not come.
    busy : out   std_logic;
    -- For a clock each: a frame and a line begin to go in; a frame begins to come out, a line has come out; the source
    -- and the core had to wait; a transfer belongs to no frame.
    frame_in  : out   std_logic;
    line_in   : out   std_logic;
    frame_out : out   std_logic;
    line_out  : out   std_logic;
    stall_in  : out   std_logic;
    stall_out : out   std_logic;
    dropped   : out   std_logic
  );
end entity frame_gate;

architecture rtl of frame_gate is

  -- The frame that began last was let in.
  signal let_in    : std_logic := '0';
  signal lets      : std_logic;
  signal ready     : std_logic;
  signal transfer  : std_logic;
  signal size_good : std_logic;

  -- A frame is under way; what comes is the excess of a line; the next pixel's place.
  signal frame_open : std_logic             := '0';
  signal excess     : std_logic             := '0';
  signal column     : unsigned(13 downto 0) := (others => '0');
  signal row        : unsigned(15 downto 0) := (others => '0');

begin

  lets          <= enable when s_axis_tuser = "1" else
                   let_in;
  core_tvalid   <= s_axis_tvalid and lets;
  ready         <= core_tready or not lets;
  s_axis_tready <= ready;
  transfer      <= s_axis_tvalid and ready;
  busy          <= frame_open;

  size_good <= '1' when unsigned(columns) /= 0 and unsigned(columns) <= MAX_COLUMNS and unsigned(rows) /= 0 else
               '0';

  follow_frames : process (clk) is

    variable belongs   : boolean;
    variable at_column : unsigned(13 downto 0);
    variable at_row    : unsigned(15 downto 0);

  begin

    if rising_edge(clk) then
      frame_in <= '0';
      line_in  <= '0';
      dropped  <= '0';

      belongs   := frame_open = '1' and excess = '0';
      at_column := column;
      at_row    := row;
      if s_axis_tuser = "1" then
        belongs   := lets = '1' and size_good = '1';
        at_column := (others => '0');
        at_row    := (others => '0');
      end if;

      if transfer = '1' then
        if s_axis_tuser = "1" then
          let_in     <= lets;
          frame_open <= '0';
          excess     <= '0';
          if belongs then
            frame_in   <= '1';
            frame_open <= '1';
          end if;
        end if;

        if belongs then
          if at_column = 0 then
            line_in <= '1';
          end if;
          column <= at_column + PIXELS_PER_CLOCK;
          row    <= at_row;
          -- The last pixel that the line is to have, or the last one that it has.
          if at_column + PIXELS_PER_CLOCK >= unsigned(columns) or s_axis_tlast = '1' then
            column <= (others => '0');
            row    <= at_row + 1;
            excess <= not s_axis_tlast;
            if at_row + 1 = unsigned(rows) then
              frame_open <= '0';
            end if;
          end if;
        else
          dropped <= '1';
          if s_axis_tlast = '1' then
            excess <= '0';
          end if;
        end if;
      end if;

      if reset = '1' then
        let_in     <= '0';
        frame_open <= '0';
        excess     <= '0';
        frame_in   <= '0';
        line_in    <= '0';
        dropped    <= '0';
      end if;
    end if;

  end process follow_frames;

  watch : process (clk) is
  begin

    if rising_edge(clk) then
      frame_out <= m_axis_tvalid and m_axis_tready and m_axis_tuser(0) and not reset;
      line_out  <= m_axis_tvalid and m_axis_tready and m_axis_tlast and not reset;
      stall_in  <= s_axis_tvalid and not ready and not reset;
      stall_out <= m_axis_tvalid and not m_axis_tready and not reset;
    end if;

  end process watch;

end architecture rtl;

-- SPDX-License-Identifier: Apache-2.0
-- The column pass of a focal stack: one memory of pixels, and for each slice its moving sums.
--
-- From the memory each slice takes the pixel that enters its sum and the one that leaves it. Their places depend on
-- the phase of the line alone.
--
-- Frames must begin at least output_delay + 1 lines apart, and a multiple of M lines; the sequencer appends flush
-- lines.
--
-- Latency: output_delay lines and STACK_COLUMN_LATENCY clocks. Throughput: one token each clock; one column comes at
-- least PARTIAL_SUM_LOOP clocks apart.
-- Equation: for each slice sum += entering pixel - leaving pixel; see sum_schedule_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;
use work.focal_stack_pkg.all;

entity stack_columns is
  generic (
    -- Geometry of the slices.
    GEOMETRY : geometry_t;
    -- Longest line in pixels.
    COLUMNS : positive;
    -- Values of a token that have sums of their own: channels of its pixels.
    LANES : positive;
    -- Width of such a value.
    LANE_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token and its values.
    token : in    token_t;
    data  : in    std_logic_vector(LANES * LANE_BITS - 1 downto 0);
    -- The token behind the pass (token_path), and the sums, slice 0 in the low bits.
    out_token : out   token_t;
    out_data  : out   std_logic_vector(stack_sum_bits(GEOMETRY, LANES, LANE_BITS) - 1 downto 0)
  );
end entity stack_columns;

architecture rtl of stack_columns is

  constant M            : positive := GEOMETRY.micro_image_size;
  constant SLICES       : positive := GEOMETRY.slices;
  constant PIXEL_BITS   : positive := LANES * LANE_BITS;
  constant SUM_BITS     : positive := column_sum_bits(GEOMETRY, LANE_BITS);
  constant SUMS_BITS    : positive := LANES * SUM_BITS;
  constant COLUMN_BITS  : positive := bits_for(COLUMNS - 1);
  constant HISTORY_BITS : positive := history_word_bits(GEOMETRY, PIXEL_BITS);

  subtype phase_t is natural range 0 to larger(M - 1, 1);

  type phases_t is array (natural range 0 to SLICES - 1) of phase_t;

  type columns_t is array (1 to 3) of unsigned(COLUMN_BITS - 1 downto 0);

  subtype pixel_t is std_logic_vector(PIXEL_BITS - 1 downto 0);

  type pixels_t is array (1 to 3) of pixel_t;

  constant NO_SLICE : unsigned(bits_for(SLICES - 1) - 1 downto 0) := (others => '0');

  -- enters_at, leaves_at: places of a phase's entering and leaving pixel in the shift register of the phase (-1 for the
  -- line that is just coming in); base: place of that register in the word.
  type history_t is record
    enters_at : integer;
    leaves_at : integer;
    base      : natural;
  end record history_t;

  type histories_t is array (natural range 0 to M - 1) of history_t;

  function all_histories (
    slice : natural
  ) return histories_t is

    variable histories : histories_t;

  begin

    -- The phase alone decides which pixel enters: a multiplexer with M fixed inputs, no address.
    for v in 0 to M - 1 loop

      histories(v) :=
      (
        enters_at => history_place(GEOMETRY, entering_age(GEOMETRY, slice, v)),
        leaves_at => history_place(GEOMETRY, leaving_age(GEOMETRY, slice, v)),
        base      => history_base(GEOMETRY, v)
      );

    end loop;

    return histories;

  end function all_histories;

  -- The pixel at a place of the shift register that begins at `base`; zero if the memory does not hold it yet.
  function pixel_in (
    words : std_logic_vector;
    base  : natural;
    place : integer
  ) return pixel_t is

    variable low : natural;

  begin

    if place < 0 then
      return (others => '0');
    end if;

    low := (base + place) * PIXEL_BITS;

    return words(low + PIXEL_BITS - 1 downto low);

  end function pixel_in;

  -- Names of signals end in the number of clocks behind the token.
  -- active: the token has a pixel; step: the first pixel of its line.
  signal active : std_logic;
  signal step   : std_logic;
  -- The phase of the line. All slices have the same.
  signal phase_1 : phases_t;
  signal phase_2 : phase_t := 0;
  signal phase_3 : phase_t := 0;
  -- The pixels that come in, and the memory's word of the same column with the lines before, for all slices.
  signal pixel_at  : pixels_t := (others => (others => '0'));
  signal history_3 : std_logic_vector(HISTORY_BITS - 1 downto 0);

  signal active_at : std_logic_vector(1 to 3) := (others => '0');
  signal column_at : columns_t                := (others => (others => '0'));

begin

  active <= token.strobe and token.pixel;
  step   <= active and token.line_first;

  count_columns : process (clk) is
  begin

    if rising_edge(clk) then
      -- The column is counted here, because tokens carry none; empty tokens between pixels must not move it.
      if step = '1' then
        column_at(1) <= (others => '0');
      elsif active = '1' then
        column_at(1) <= column_at(1) + 1;
      end if;
      column_at(2 to 3) <= column_at(1 to 2);
      active_at         <= active & active_at(1 to 2);
      pixel_at(1)       <= data;
      pixel_at(2 to 3)  <= pixel_at(1 to 2);
      -- The phase counts lines modulo M, so all slices have the same: slice 0 provides it.
      phase_2 <= phase_1(0);
      phase_3 <= phase_2;
      if reset = '1' then
        active_at <= (others => '0');
      end if;
    end if;

  end process count_columns;

  -- One memory serves all slices, which differ only in the pixels that they take from its word.
  memory : entity work.line_history
    generic map (
      GEOMETRY   => GEOMETRY,
      COLUMNS    => COLUMNS,
      PIXEL_BITS => PIXEL_BITS
    )
    port map (
      clk      => clk,
      column   => column_at(1),
      active   => active_at(3),
      phase    => phase_3,
      column_2 => column_at(3),
      pixel    => pixel_at(3),
      history  => history_3
    );

  -- The large memory of pixels is shared. Each slice adds only an adder and a word for each column.
  slice : for s in 0 to SLICES - 1 generate

    constant HISTORY_OF : histories_t := all_histories(s);

    signal ring          : ring_control_t;
    signal enter_phase_3 : phase_t       := 0;
    signal leave_phase_3 : phase_t       := 0;
    signal choice_3      : pixel_choice_t;
    signal command_3     : sum_command_t;
    signal command_4     : sum_command_t := NO_COMMAND;
    signal active_4      : std_logic     := '0';
    signal in_4          : pixel_t       := (others => '0');
    signal entering_4    : pixel_t       := (others => '0');
    signal leaving_4     : pixel_t       := (others => '0');

  begin

    phase_1(s) <= ring.phase_1;

    -- The control is built for one slice alone, so its tables are constants.
    control : entity work.moving_sum_control
      generic map (
        GEOMETRY    => GEOMETRY,
        FIXED_SLICE => s
      )
      port map (
        clk       => clk,
        reset     => reset,
        advance   => step,
        first     => token.frame_first,
        live      => token.image,
        slice     => NO_SLICE,
        ring      => ring,
        choice_3  => choice_3,
        command_3 => command_3
      );

    pick : process (clk) is

      variable leaves : boolean;

    begin

      if rising_edge(clk) then
        enter_phase_3 <= ring.enter_phase_2;
        leave_phase_3 <= ring.leave_phase_2;

        active_4   <= active_at(3);
        command_4  <= command_3;
        in_4       <= pixel_at(3);
        entering_4 <= (others => '0');
        leaving_4  <= (others => '0');

        -- The loop compares with each phase: its pixels are at fixed places of the word, so no address is computed.
        for v in 0 to M - 1 loop

          if choice_3.enter = '1' and enter_phase_3 = v then
            entering_4 <= pixel_in(history_3, HISTORY_OF(v).base, HISTORY_OF(v).enters_at);
          end if;
          -- If no pixel ever leaves, the memory does not hold the place. With a box of M the phase is the one that
          -- enters.
          leaves := leave_phase_3 = v;
          if GEOMETRY.boxes(s) = M then
            leaves := enter_phase_3 = v;
          end if;
          if choice_3.leave = '1' and leaves and pixels_leave(GEOMETRY) then
            leaving_4 <= pixel_in(history_3, HISTORY_OF(v).base, HISTORY_OF(v).leaves_at);
          end if;

        end loop;

        -- This assignment comes last and wins: the pixel that has just come is not in the memory yet.
        if choice_3.enter = '1' and choice_3.enter_now = '1' then
          entering_4 <= pixel_at(3);
        end if;
        if reset = '1' then
          active_4 <= '0';
        end if;
      end if;

    end process pick;

    -- The adder keeps running and first sums of each column; with held outputs their results too.
    adder : entity work.moving_sum_adder
      generic map (
        COLUMNS      => COLUMNS,
        LANES        => LANES,
        PIXEL_BITS   => LANE_BITS,
        SUM_BITS     => SUM_BITS,
        WITH_LEAVING => pixels_leave(GEOMETRY),
        HOLDING      => group_size(GEOMETRY, s) > 1,
        SPLIT        => not begins_group(GEOMETRY, s, 0)
      )
      port map (
        clk      => clk,
        reset    => reset,
        column   => column_at(2),
        active   => active_4,
        command  => command_4,
        own      => in_4,
        entering => entering_4,
        leaving  => leaving_4,
        sums     => out_data((s + 1) * SUMS_BITS - 1 downto s * SUMS_BITS)
      );

  end generate slice;

  -- All slices have the same delay, so one path of tokens serves all.
  path : entity work.token_path
    generic map (
      LATENCY => STACK_COLUMN_LATENCY,
      DELAY   => GEOMETRY.output_delay,
      COLUMNS => true
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      step      => step,
      out_token => out_token
    );

  -- Simulation stops if a frame comes too early: frames share the phases of the memory's lines, and a frame's
  -- first outputs follow the last outputs of the frame before. Marks without an image are left in the path of
  -- tokens by a reset and do not count.
  watch_frames : process (clk) is

    variable lines : integer := -1;

  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      if reset = '1' then
        lines := -1;
      elsif step = '1' then
        assert not (token.frame_first = '1' and token.image = '1' and lines >= 0 and
                    (lines <= GEOMETRY.output_delay or lines mod M /= 0))
          report "stack_columns: frames begin too few lines apart, or no multiple of M lines"
          severity failure;
        if token.frame_first = '1' and token.image = '1' then
          lines := 1;
        elsif lines >= 0 then
          lines := lines + 1;
        end if;
      end if;
    end if;

  -- synthesis translate_on

  end process watch_frames;

end architecture rtl;

-- SPDX-License-Identifier: Apache-2.0
-- A row filter for one a' >= 1 with one of three broadcast nets, to compare them: see systolic.py.
--
-- NET = 0: switched_fir, the pixel goes to all taps at once. NET > 0: the same with latches that drive that many taps
-- each. NET = -1: full-systolic, the pixel, its phase and its place go from tap to tap, a register between any two, and each tap
-- keeps the partial sum of the step before for the one behind it.
--
-- Latency: 1 clock, 2 with latches, TAPS with NET = -1; `sum_valid` tells.
-- Throughput: one step each clock, and it may pause.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;

entity row_filter is
  generic (
    MICRO_IMAGE_SIZE : positive;
    SHIFT            : positive;
    PIXEL_BITS       : positive;
    NET              : integer
  );
  port (
    clk  : in    std_logic;
    step : in    std_logic;
    -- The first pixel of a line.
    first     : in    std_logic;
    data      : in    std_logic_vector(PIXEL_BITS - 1 downto 0);
    sum       : out   std_logic_vector(bits_for(MICRO_IMAGE_SIZE * (2 ** PIXEL_BITS - 1)) - 1 downto 0);
    sum_valid : out   std_logic
  );
end entity row_filter;

architecture rtl of row_filter is

  constant M        : positive := MICRO_IMAGE_SIZE;
  constant TAPS     : positive := M + (M - 1) * (SHIFT - 1);
  constant DELAY    : natural  := (TAPS - 1) / 2;
  constant DATA_MAX : positive := 2 ** PIXEL_BITS - 1;
  constant SUM_BITS : positive := sum'length;

  subtype phase_t is natural range 0 to M - 1;

  -- Place of a pixel in its line; from DELAY on it does not matter.
  subtype place_t is natural range 0 to DELAY;

  -- Whether the switch of a tap is closed for a pixel of a micro image: not for outputs of the line before. Written
  -- without arithmetic on signals, so that it becomes a small table for each tap.
  function is_closed (
    tap   : natural;
    phase : phase_t;
    place : place_t
  ) return std_logic is

    constant AGE     : natural := TAPS - 1 - tap;
    variable decoded : std_logic;

  begin

    decoded := '0';

    for u in 0 to M - 1 loop

      if AGE >= u * (SHIFT - 1) and AGE < u * (SHIFT - 1) + M and phase = u then
        decoded := '1';
      end if;

    end loop;

    for k in 0 to DELAY - 1 loop

      if k + AGE < DELAY and place = k then
        decoded := '0';
      end if;

    end loop;

    return decoded;

  end function is_closed;

  signal next_phase : phase_t := 0;
  signal phase      : phase_t;
  signal next_place : place_t := 0;
  signal place      : place_t;

begin

  phase <= 0 when first = '1' else
           next_phase;
  place <= 0 when first = '1' else
           next_place;

  count : process (clk) is
  begin

    if rising_edge(clk) then
      if step = '1' then
        if phase = M - 1 then
          next_phase <= 0;
        else
          next_phase <= phase + 1;
        end if;
        if place = DELAY then
          next_place <= DELAY;
        else
          next_place <= place + 1;
        end if;
      end if;
    end if;

  end process count;

  semi_systolic : if NET >= 0 generate

    signal closed : std_logic_vector(0 to TAPS - 1);
    -- The switches of each phase come from a register, as those of switch_control do.
    signal step_d1  : std_logic := '0';
    signal step_d2  : std_logic := '0';
    signal step_d3  : std_logic := '0';
    signal first_d1 : std_logic := '0';
    signal data_d1  : std_logic_vector(data'range);

  begin

    look_up : process (clk) is
    begin

      if rising_edge(clk) then
        step_d1  <= step;
        step_d2  <= step_d1;
        step_d3  <= step_d2;
        first_d1 <= first;
        data_d1  <= data;

        for w in 0 to TAPS - 1 loop

          closed(w) <= is_closed(w, phase, place);

        end loop;

      end if;

    end process look_up;

    filter : entity work.switched_fir
      generic map (
        TAPS           => TAPS,
        DELAY          => DELAY,
        DEPTH          => 1,
        HOLD           => false,
        DATA_MAX       => DATA_MAX,
        SUM_MAX        => M * DATA_MAX,
        BROADCAST_TAPS => NET
      )
      port map (
        clk     => clk,
        slot    => "0",
        step    => step_d1,
        resume  => '0',
        restart => first_d1,
        update  => '0',
        closed  => closed,
        data    => data_d1,
        sum     => sum
      );

    sum_valid <= step_d2 when NET = 0 else
                 step_d3;

  end generate semi_systolic;

  systolic : if NET < 0 generate

    type datas_t is array (natural range 0 to TAPS) of std_logic_vector(data'range);

    type phases_t is array (natural range 0 to TAPS) of phase_t;

    type places_t is array (natural range 0 to TAPS) of place_t;

    type sums_t is array (natural range 0 to TAPS - 1) of unsigned(SUM_BITS - 1 downto 0);

    signal datas  : datas_t;
    signal phases : phases_t;
    signal places : places_t;
    signal steps  : std_logic_vector(0 to TAPS) := (others => '0');
    signal firsts : std_logic_vector(0 to TAPS);
    -- Of the step that a tap took last, and of the one before.
    signal sums    : sums_t := (others => (others => '0'));
    signal earlier : sums_t := (others => (others => '0'));

  begin

    datas(0)  <= data;
    phases(0) <= phase;
    places(0) <= place;
    steps(0)  <= step;
    firsts(0) <= first;

    move : process (clk) is

      variable carried : unsigned(SUM_BITS - 1 downto 0);

    begin

      if rising_edge(clk) then
        datas(1 to TAPS)  <= datas(0 to TAPS - 1);
        phases(1 to TAPS) <= phases(0 to TAPS - 1);
        places(1 to TAPS) <= places(0 to TAPS - 1);
        steps(1 to TAPS)  <= steps(0 to TAPS - 1);
        firsts(1 to TAPS) <= firsts(0 to TAPS - 1);

        for w in 0 to TAPS - 1 loop

          if steps(w) = '1' then
            carried := (others => '0');
            if w > 0 and not (firsts(w) = '1' and w <= TAPS - 1 - DELAY) then
              carried := earlier(w - 1);
            end if;
            if is_closed(w, phases(w), places(w)) = '1' then
              carried := carried + unsigned(datas(w));
            end if;
            earlier(w) <= sums(w);
            sums(w)    <= carried;
          end if;

        end loop;

      end if;

    end process move;

    sum       <= std_logic_vector(sums(TAPS - 1));
    sum_valid <= steps(TAPS);

  end generate systolic;

end architecture rtl;

-- SPDX-License-Identifier: Apache-2.0
-- Depth between slices: the vertex of the parabola through the sharpness of the sharpest slice of a micro image and its
-- two neighbours.
--
-- The neighbours are l and r away from the sharpest slice. The vertex lies between the middles of these two intervals
-- and divides the way from one middle to the other in the ratio of the slopes. The fraction is given in 256ths of that
-- way, so that index and fraction together are one number that grows with depth. The curvature of the parabola gives
-- the confidence. The first slice, the last one, and micro images that took another slice by vote have no vertex: they
-- get the middle, with confidence 0.
--
-- The division is a chain of subtractions, one bit in each pipeline stage, so that it keeps up with the scan: one micro
-- image each clock. With votes the results wait like their rows.
--
-- Latency: VOTE_RADIUS rows and larger(FRACTION_LATENCY, vote_latency) clocks. Throughput: one micro image each clock.
-- Equation: fraction = min(255, floor(256 p / (p + q))), p = r (most - prior), q = l (most - behind);
--   confidence = (2 most - prior - behind) / 2**CURVATURE_DROP, between 1 and 255.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;

entity depth_fraction is
  generic (
    -- The shifts go up or down from slice to slice.
    BUILD : index_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- active: there is a micro image; lens: its number; index: its sharpest slice; most, prior, behind: the sharpness
    -- of that slice, of the slice before and of the slice behind.
    active : in    std_logic;
    lens   : in    unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0);
    index  : in    unsigned(bits_for(BUILD.slices - 1) - 1 downto 0);
    most   : in    unsigned(BUILD.sharpness_bits - 1 downto 0);
    prior  : in    unsigned(BUILD.sharpness_bits - 1 downto 0);
    behind : in    unsigned(BUILD.sharpness_bits - 1 downto 0);
    -- The depth of the micro image VOTE_RADIUS rows before, if that kept its slice.
    depth : out   depth_t
  );
end entity depth_fraction;

architecture rtl of depth_fraction is

  constant LENS_BITS  : positive := bits_for(BUILD.lenses - 1);
  constant INDEX_BITS : positive := bits_for(BUILD.slices - 1);
  constant DEPTH_BITS : positive := 2 * FRACTION_BITS;
  constant VOTE_WAIT  : natural  := larger(vote_latency(BUILD.slices, BUILD.vote_radius, BUILD.boxes) -
                                           FRACTION_LATENCY, 0);
  -- The first subtraction is in the clock behind READY.
  constant READY : positive := FRACTION_LATENCY - FRACTION_BITS;

  type factors_t is array (natural range 0 to 2 ** INDEX_BITS - 1) of positive;

  -- For each slice the step to the next slice (it weights the slope before), or the step from the slice before (it
  -- weights the slope behind). Common factors are removed, so that even steps need no multiplication.
  function factors (
    to_behind : boolean
  ) return factors_t is

    variable made : factors_t;

  begin

    made := (others => 1);

    for s in 1 to BUILD.slices - 2 loop

      made(s) := step_weight(BUILD.shifts, s, to_behind);

    end loop;

    return made;

  end function factors;

  function largest (
    table : factors_t
  ) return positive is

    -- At least 1, so that a stack of two slices, which has no inner slice, gets a valid width.
    variable most_of_all : positive;

  begin

    most_of_all := 1;

    for s in 0 to BUILD.slices - 1 loop

      most_of_all := larger(most_of_all, table(s));

    end loop;

    return most_of_all;

  end function largest;

  constant WEIGHT_BEFORE : factors_t := factors(true);
  constant WEIGHT_BEHIND : factors_t := factors(false);

  constant FACTOR_BITS : positive := bits_for(larger(largest(WEIGHT_BEFORE), largest(WEIGHT_BEHIND)));
  constant PART_BITS   : positive := BUILD.sharpness_bits + FACTOR_BITS;
  -- A sum of two parts has a bit more than each part. The curvature comes from falls in sharpness without the steps'
  -- weights, because CONFIDENCE is a difference of sharpness too.
  constant WHOLE_BITS : positive := PART_BITS + 1;
  constant CURVE_BITS : positive := BUILD.sharpness_bits + 1;
  -- Bits that are cut off the curvature, so that a curvature of CONFIDENCE becomes 16 to 31.
  constant DROP : natural := larger(bits_for(BUILD.confidence) - 5, 0);

  subtype whole_t is unsigned(WHOLE_BITS - 1 downto 0);

  subtype fraction_t is std_logic_vector(FRACTION_BITS - 1 downto 0);

  type wholes_t is array (READY to FRACTION_LATENCY) of whole_t;

  type fractions_t is array (READY to FRACTION_LATENCY) of fraction_t;

  -- Names of signals end in the number of clocks behind the micro image.
  signal index_1       : unsigned(INDEX_BITS - 1 downto 0)           := (others => '0');
  signal fall_before_1 : unsigned(BUILD.sharpness_bits - 1 downto 0) := (others => '0');
  signal fall_behind_1 : unsigned(BUILD.sharpness_bits - 1 downto 0) := (others => '0');
  signal part_before_2 : unsigned(PART_BITS - 1 downto 0)            := (others => '0');
  signal part_behind_2 : unsigned(PART_BITS - 1 downto 0)            := (others => '0');
  signal curvature_2   : unsigned(CURVE_BITS - 1 downto 0)           := (others => '0');
  signal inner_2       : std_logic                                   := '0';
  -- Confidence; 0: there is no vertex.
  signal sure_3 : fraction_t := (others => '0');
  signal sure   : fraction_t;
  -- The remainder, the divisor (whole), and the quotient's bits so far.
  signal rest_at     : wholes_t    := (others => (others => '0'));
  signal whole_at    : wholes_t    := (others => (others => '0'));
  signal fraction_at : fractions_t := (others => (others => '0'));
  -- The depth found for the micro image, and the depths VOTE_RADIUS rows before.
  signal found  : std_logic_vector(DEPTH_BITS - 1 downto 0);
  signal middle : std_logic_vector(DEPTH_BITS - 1 downto 0);
  signal late   : std_logic_vector(DEPTH_BITS - 1 downto 0);
  -- Confidences that wait for the division; depths that wait for the votes.
  signal sures : std_logic_vector(delay_bits(FRACTION_BITS, FRACTION_BITS) - 1 downto 0) := (others => '0');
  signal lates : std_logic_vector(delay_bits(DEPTH_BITS, VOTE_WAIT) - 1 downto 0)        := (others => '0');

begin

  --------------------------------------------------------------------------------------------------
  -- Clock 1: how far the sharpness falls to either side. 2: slopes on one scale. 3: the divisor and the confidence.

  prepare : process (clk) is

    variable curve : unsigned(CURVE_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then
      -- The sharpest slice has the most sharpness, so neither fall is negative.
      index_1       <= index;
      fall_before_1 <= most - prior;
      fall_behind_1 <= most - behind;

      -- Slopes of unequal steps are brought to one scale by multiplying each with the other's step.
      part_before_2 <= fall_before_1 * to_unsigned(WEIGHT_BEFORE(to_integer(index_1)), FACTOR_BITS);
      part_behind_2 <= fall_behind_1 * to_unsigned(WEIGHT_BEHIND(to_integer(index_1)), FACTOR_BITS);
      curvature_2   <= resize(fall_before_1, CURVE_BITS) + fall_behind_1;
      inner_2       <= to_logic(index_1 /= 0 and index_1 /= BUILD.slices - 1);

      curve  := shift_right(curvature_2, DROP);
      sure_3 <= std_logic_vector(resize(curve, FRACTION_BITS));
      if curve > 2 ** FRACTION_BITS - 1 then
        sure_3 <= (others => '1');
      -- 0 means that there is no vertex; an uncertain vertex gets at least 1.
      elsif curve = 0 then
        sure_3(0) <= '1';
      end if;
      if inner_2 = '0' then
        sure_3 <= (others => '0');
      end if;
    end if;

  end process prepare;

  --------------------------------------------------------------------------------------------------
  -- Division: one bit each clock from READY on.

  divide : process (clk) is

    variable double : unsigned(WHOLE_BITS downto 0);

  begin

    if rising_edge(clk) then
      -- The confidence waits beside the division.
      sures <= moved_on(sures, sure_3);
      -- The dividend is the part before; the divisor is the sum of the parts before and behind.
      rest_at(READY)  <= resize(part_before_2, WHOLE_BITS);
      whole_at(READY) <= resize(part_before_2, WHOLE_BITS) + part_behind_2;

      for i in READY to FRACTION_LATENCY - 1 loop

        -- One step of the division: twice the remainder, less the divisor if that fits; the bit says whether it does.
        double             := rest_at(i) & '0';
        whole_at(i + 1)    <= whole_at(i);
        fraction_at(i + 1) <= fraction_at(i)(FRACTION_BITS - 2 downto 0) & to_logic(double >= whole_at(i));
        rest_at(i + 1)     <= double(WHOLE_BITS - 1 downto 0);
        -- The remainder never exceeds the divisor. If both are equal they stay equal, and all bits are ones.
        if double >= whole_at(i) then
          rest_at(i + 1) <= resize(double - whole_at(i), WHOLE_BITS);
        end if;

      end loop;

    end if;

  end process divide;

  sure <= delayed(sures, sure_3, FRACTION_BITS);

  -- The middle of the interval stands for the slice itself.
  found <= NO_DEPTH.confidence & NO_DEPTH.fraction when unsigned(sure) = 0 else
           sure & fraction_at(FRACTION_LATENCY);

  --------------------------------------------------------------------------------------------------
  -- Rows that wait for their votes.

  no_votes : if BUILD.vote_radius = 0 generate
    middle <= found;
  end generate no_votes;

  votes : if BUILD.vote_radius > 0 generate

    constant KEPT_BITS : positive := BUILD.vote_radius * DEPTH_BITS;
    constant TAG_BITS  : positive := LENS_BITS + 1;

    -- The number of the micro image: 2 clocks before its depth, for the read address, and with its depth.
    signal place_0 : std_logic_vector(TAG_BITS - 1 downto 0);
    signal place_9 : std_logic_vector(TAG_BITS - 1 downto 0);
    signal place   : std_logic_vector(TAG_BITS - 1 downto 0);
    signal places  : std_logic_vector(delay_bits(TAG_BITS, FRACTION_LATENCY) - 1 downto 0) := (others => '0');
    signal lens_9  : unsigned(LENS_BITS - 1 downto 0);
    signal lens_11 : unsigned(LENS_BITS - 1 downto 0);
    signal rows    : std_logic_vector(KEPT_BITS - 1 downto 0);
    signal moved   : std_logic_vector(KEPT_BITS + DEPTH_BITS - 1 downto 0);

  begin

    -- Mark and number are delayed together, because both are used twice: for the read and for the write.
    place_0 <= std_logic_vector(lens) & active;
    place_9 <= delayed(places, place_0, FRACTION_LATENCY - 2);
    place   <= delayed(places, place_0, FRACTION_LATENCY);

    delay_place : process (clk) is
    begin

      if rising_edge(clk) then
        places <= moved_on(places, place_0, reset => reset);
      end if;

    end process delay_place;

    lens_9  <= unsigned(place_9(LENS_BITS downto 1));
    lens_11 <= unsigned(place(LENS_BITS downto 1));

    rows_before : entity work.ram_simple_dual_port
      generic map (
        WIDTH => KEPT_BITS,
        WORDS => BUILD.lenses
      )
      port map (
        clk           => clk,
        write_enable  => place(0),
        write_address => lens_11,
        write_data    => moved(KEPT_BITS - 1 downto 0),
        read_address  => lens_9,
        read_data     => rows
      );

    -- Rows that wait lie in one word, the oldest at the left. With this row's depth at the right, the oldest is the row
    -- whose votes are counted.
    moved  <= rows & found;
    middle <= moved(KEPT_BITS + DEPTH_BITS - 1 downto KEPT_BITS);

  end generate votes;

  late <= delayed(lates, middle, VOTE_WAIT);

  -- Votes of many slices take longer than the division, so depths wait.
  wait_for_votes : process (clk) is
  begin

    if rising_edge(clk) then
      lates <= moved_on(lates, middle);
    end if;

  end process wait_for_votes;

  depth.fraction   <= late(FRACTION_BITS - 1 downto 0);
  depth.confidence <= late(DEPTH_BITS - 1 downto FRACTION_BITS);

end architecture rtl;

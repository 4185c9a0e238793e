-- SPDX-License-Identifier: Apache-2.0
-- A pass of the refocusing operator over rows, several neighbouring pixels a token.
--
--   data -> banks of pixels -> differences -> prefix sums -> out_data
--        -> sum ahead of the line --------------^
--
-- The results equal those of moving_sum_stage, which takes one pixel a token, bit for bit. Pixels behind the end of
-- a line must be zero; sums behind it come out as zero, because the next pass goes on there. Lines must begin at least
-- lane_delay + 1 tokens apart.
--
-- Latency: lane_delay tokens and lane_stage_latency clocks. Throughput: one token each clock.
-- Equation: see sum_lanes_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;
use work.sum_schedule_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;

entity lane_stage is
  generic (
    -- Geometry of the slices (of one slice alone if the slice is always the same), at least two pixels a token, their
    -- channels and width.
    BUILD : lanes_build_t;
    -- Width of a channel of the output: holds M times the largest input.
    SUM_BITS : positive;
    -- Width of the tag that goes with a token.
    TAG_BITS : positive := 1
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, its pixels (pixel 0 and channel 0 in the low bits), and a tag.
    token : in    token_t;
    data  : in    std_logic_vector(BUILD.pixels * BUILD.channels * BUILD.pixel_bits - 1 downto 0);
    tag   : in    std_logic_vector(TAG_BITS - 1 downto 0) := (others => '0');
    -- Which pixels a line's last token has; constant while a frame is under way.
    line_end : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    -- The token of lane_delay tokens before, its sums, and its tag.
    out_token : out   token_t;
    out_data  : out   std_logic_vector(BUILD.pixels * BUILD.channels * SUM_BITS - 1 downto 0);
    out_tag   : out   std_logic_vector(TAG_BITS - 1 downto 0)
  );
end entity lane_stage;

architecture rtl of lane_stage is

  constant GEOMETRY  : geometry_t := BUILD.geometry;
  constant CHANNELS  : positive   := BUILD.channels;
  constant DATA_BITS : positive   := BUILD.pixel_bits;

  constant M      : positive := GEOMETRY.micro_image_size;
  constant P      : positive := BUILD.pixels;
  constant SLICES : positive := GEOMETRY.slices;
  constant PLACES : positive := token_places(M, P);
  constant LEVELS : positive := bits_for(P - 1);
  constant DELAY  : natural  := lane_delay(GEOMETRY, P);
  -- Clocks from a token to its differences, and to their prefix sums.
  constant DIFFERENT : positive := 6 + choose(SLICES > 1, 1, 0);
  constant SUMMED    : positive := DIFFERENT + LEVELS;

  -- Whether any slice holds outputs (shows one sum for a group of outputs).
  constant HOLDING : boolean := holds_outputs(GEOMETRY);

  constant SLICE_BITS : positive := bits_for(SLICES - 1);

  subtype place_t is natural range 0 to larger(PLACES - 1, 1);

  subtype row_t is unsigned(BUILD.row_bits - 1 downto 0);

  subtype lanes_t is std_logic_vector(P - 1 downto 0);

  subtype sums_t is std_logic_vector(CHANNELS * SUM_BITS - 1 downto 0);

  -- Places whose outputs begin a group, between two ones that keep words from being zero (moving_sum_pkg.table_words).

  type begins_t is array (natural range 0 to 2 ** bits_for(SLICES - 1) * 2 ** bits_for(PLACES - 1) - 1)
      of std_logic_vector(P + 1 downto 0);

  function begins_table return begins_t is

    variable table : begins_t;

  begin

    -- Places that occur in no slice count as beginning a group; their outputs are not shown.
    table := (others => (others => '1'));

    for s in 0 to SLICES - 1 loop

      for k in 0 to PLACES - 1 loop

        for j in 0 to P - 1 loop

          if not begins_group(GEOMETRY, s, (k * bank_step(M, P) + j) mod M) then
            table(s * 2 ** bits_for(PLACES - 1) + k)(j + 1) := '0';
          end if;

        end loop;

      end loop;

    end loop;

    return table;

  end function begins_table;

  constant BEGINS_OF : begins_t := begins_table;

  -- For each token, which of its outputs begin a group.
  type begins_list_t is array (natural range <>) of lanes_t;

  type gathered_t is array (0 to 1) of sums_t;

  -- first: the token begins a line; slice: the line's slice, read with that token.
  signal first : std_logic;
  signal slice : unsigned(SLICE_BITS - 1 downto 0);

  -- Names of signals end in the number of clocks behind a token.
  signal pixels_1     : std_logic_vector(P * CHANNELS * DATA_BITS - 1 downto 0) := (others => '0');
  signal write_1      : lanes_write_t;
  signal read_1       : lanes_read_t;
  signal fresh_1      : std_logic;
  signal ahead_1      : lanes_t;
  signal held_1       : lanes_t;
  signal read_slice_1 : unsigned(slice'range);
  signal read_place_1 : place_t;
  -- The entering pixel less the leaving one for each pixel of the token. Signed, so a bit wider than pixels.
  signal differences : std_logic_vector(P * CHANNELS * (DATA_BITS + 1) - 1 downto 0);
  -- active: outputs leave; take: they begin with output 0. Both wait until their differences are summed.
  signal active_at : std_logic_vector(1 to SUMMED) := (others => '0');
  signal take_at   : std_logic_vector(1 to SUMMED) := (others => '0');
  -- Which outputs of the token begin a group of equal ones.
  signal begins_2  : std_logic_vector(P + 1 downto 0) := (others => '1');
  signal begins_at : begins_list_t(2 to SUMMED)       := (others => (others => '1'));
  -- ahead: the sum of the pixels that came before the line's first output; held: the sum that output 0 shows.
  signal ahead    : sums_t;
  signal held     : sums_t;
  signal chosen_1 : begins_list_t(0 to 1);
  signal gathered : gathered_t;
  -- The token behind the stage, and the sums of all its pixels.
  signal sum_token : token_t;
  signal sums      : std_logic_vector(out_data'range);

begin

  first <= begins_line(token);
  slice <= (others => '0') when SLICES = 1 else
           token.slice(SLICE_BITS - 1 downto 0);

  -- lane_control says where a token's pixels go and which outputs leave; all entities below follow a fixed number
  -- of clocks later.
  control : entity work.lane_control
    generic map (
      BUILD => BUILD
    )
    port map (
      clk     => clk,
      reset   => reset,
      strobe  => token.strobe,
      first   => first,
      live    => token.pixel,
      slice   => slice,
      write_1 => write_1,
      fresh_1 => fresh_1,
      ahead_1 => ahead_1,
      held_1  => held_1,
      read_1  => read_1
    );

  -- Pixels wait one clock, as long as lane_control takes.
  take_pixels : process (clk) is
  begin

    if rising_edge(clk) then
      pixels_1 <= data;
    end if;

  end process take_pixels;

  -- For each output the entering pixel less the leaving one, of the output's own line.
  banks : entity work.pixel_banks
    generic map (
      BUILD => BUILD
    )
    port map (
      clk         => clk,
      write_1     => write_1,
      pixels_1    => pixels_1,
      read_1      => read_1,
      differences => differences
    );

  --------------------------------------------------------------------------------------------------
  -- Sums of the pixels that come before output 0.

  chosen_1 <= (ahead_1, held_1);
  ahead    <= gathered(0);
  held     <= gathered(1);

  -- Without delay, output 0 comes with pixel 0, so no pixel comes before it. A group that begins with output 0
  -- shows the running sum; a group that began before the line shows the held one.
  before_output_0 : for i in 0 to 1 generate

    constant GATHERS : boolean := DELAY > 0 and (i = 0 or begins_within_group(GEOMETRY));

  begin

    nothing : if not GATHERS generate
      gathered(i) <= (others => '0');
    end generate nothing;

    pixels : if GATHERS generate

      gather : entity work.ahead_sum
        generic map (
          PIXELS_PER_CLOCK => P,
          CHANNELS         => CHANNELS,
          PIXEL_BITS       => DATA_BITS,
          SUM_BITS         => SUM_BITS,
          LATENCY          => SUMMED - 1
        )
        port map (
          clk    => clk,
          active => write_1.valid,
          fresh  => fresh_1,
          chosen => chosen_1(i),
          pixels => pixels_1,
          sum    => gathered(i)
        );

    end generate pixels;

  end generate before_output_0;

  --------------------------------------------------------------------------------------------------
  -- Prefix sums of the differences.

  active_at(1) <= read_1.active;
  take_at(1)   <= read_1.take;
  read_place_1 <= read_1.place;
  read_slice_1 <= read_1.slice(read_slice_1'range);

  delay_flags : process (clk) is
  begin

    if rising_edge(clk) then
      -- The marks wait for the prefix sums, a clock for each level of adders.
      active_at(2 to SUMMED) <= active_at(1 to SUMMED - 1);
      take_at(2 to SUMMED)   <= take_at(1 to SUMMED - 1);
      if reset = '1' then
        active_at(2 to SUMMED) <= (others => '0');
      end if;
    end if;

  end process delay_flags;

  -- Without groups every output is a sum of its own.
  no_groups : if not HOLDING generate
    begins_at(SUMMED) <= (others => '1');
  end generate no_groups;

  groups : if HOLDING generate

    look_up : process (clk) is
    begin

      if rising_edge(clk) then
        -- With one slice the place alone is the index: a product with the slice would add bits to it.
        if SLICES = 1 then
          begins_2 <= BEGINS_OF(read_place_1);
        else
          begins_2 <= BEGINS_OF(to_integer(read_slice_1) * 2 ** bits_for(PLACES - 1) + read_place_1);
        end if;
      end if;

    end process look_up;

    begins_at(2) <= begins_2(P downto 1);

    delay_begins : process (clk) is
    begin

      if rising_edge(clk) then
        begins_at(3 to SUMMED) <= begins_at(2 to SUMMED - 1);
      end if;

    end process delay_begins;

  end generate groups;

  -- The prefix sums turn differences into sums; the sums from before the line are added here.
  prefix : entity work.prefix_sums
    generic map (
      PIXELS_PER_CLOCK => P,
      CHANNELS         => CHANNELS,
      DIFFERENCE_BITS  => DATA_BITS + 1,
      SUM_BITS         => SUM_BITS,
      HOLDING          => HOLDING
    )
    port map (
      clk         => clk,
      differences => differences,
      active      => active_at(SUMMED),
      take        => take_at(SUMMED),
      begins      => begins_at(SUMMED),
      ahead       => ahead,
      held        => held,
      sums        => sums
    );

  path : entity work.token_path
    generic map (
      LATENCY  => lane_stage_latency(GEOMETRY, P),
      DELAY    => DELAY,
      TAG_BITS => TAG_BITS
    )
    port map (
      clk       => clk,
      reset     => reset,
      token     => token,
      step      => token.strobe,
      tag       => tag,
      out_token => sum_token,
      out_tag   => out_tag
    );

  out_token <= sum_token;
  out_data  <= in_line(sums, CHANNELS * SUM_BITS, sum_token, line_end);

end architecture rtl;

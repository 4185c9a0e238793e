-- SPDX-License-Identifier: Apache-2.0
-- Counts what reaches each output: the sums of a picture of ones, from which border_weights has its weights.
--
--   token -> moving sums of ones, a line a step -> the same, a token a step -> product of both counts
--
-- An output's weight is the product of a count for its line and one for its place in the line, so each dimension needs
-- one moving sum instead of a picture. These are the stages of the moving sums themselves, fed with ones: they have no
-- cases of their own at the ends of lines and frames, for short ones, between two that follow each other or where the
-- slice changes, whatever the engine behind it is.
--
-- Latency: total_delay lines, as many tokens (with several pixels total_lane_delay) and border_latency clocks.
-- Throughput: one token each clock, in lines and frames that are longer than these delays; empty tokens and lines make
--   up for what is missing.
-- Equation: weight = refocusing sum of a frame of ones.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.token_pkg.all;
use work.border_pkg.all;

entity border_counts is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- The slices: a' of each in pixels, with blanks in between.
    SHIFTS : string;
    -- Whether the picture stays put from slice to slice.
    CENTRED : boolean;
    -- The slice, if it is always the same; -1: that of the token.
    FIXED_SLICE : integer := -1;
    -- Moving sums that follow in each dimension.
    INTERPOLATION_ORDER : natural range 0 to 3;
    -- Pixels of a token.
    PIXELS_PER_CLOCK : positive;
    -- Width of a weight.
    WEIGHT_BITS : positive
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- A token, and the pixels that a line's last token has.
    token    : in    token_t;
    line_end : in    std_logic_vector(PIXELS_PER_CLOCK - 1 downto 0);
    -- The weights of a token's pixels, pixel 0 in the low bits; those behind a line's last pixel have no meaning.
    weights : out   std_logic_vector(PIXELS_PER_CLOCK * WEIGHT_BITS - 1 downto 0)
  );
end entity border_counts;

architecture rtl of border_counts is

  constant GEOMETRY : geometry_t := geometry_of("border_counts", MICRO_IMAGE_SIZE, SHIFTS, CENTRED);

  constant M          : positive := MICRO_IMAGE_SIZE;
  constant P          : positive := PIXELS_PER_CLOCK;
  constant PASSES     : positive := INTERPOLATION_ORDER + 1;
  constant SLICE_BITS : positive := bits_for(GEOMETRY.slices - 1);
  constant COUNT_BITS : positive := bits_for(largest_count(M, PASSES));

  -- Side information of a token; bit 0 is the one that reset clears.
  constant PIXEL      : natural := 0;
  constant LINE_FIRST : natural := 1;
  constant LINE_LAST  : natural := 2;

  subtype token_tag_t is std_logic_vector(LINE_LAST downto 0);

  -- Side information of a line.
  constant IMAGE       : natural := 0;
  constant FRAME_FIRST : natural := 1;
  constant SLICE_LOW   : natural := 2;

  subtype line_tag_t is std_logic_vector(SLICE_LOW + SLICE_BITS - 1 downto 0);

  -- Side information of a token in the passes along lines: the token's, its slice, the count of its line.
  constant ROW_SLICE_LOW : natural := LINE_LAST + 1;
  constant DOWN_LOW      : natural := ROW_SLICE_LOW + SLICE_BITS;

  subtype row_tag_t is std_logic_vector(DOWN_LOW + COUNT_BITS - 1 downto 0);

  type token_tags_t is array (natural range 0 to PASSES) of token_tag_t;

  type line_tags_t is array (natural range 0 to PASSES) of line_tag_t;

  type row_tags_t is array (natural range 0 to PASSES) of row_tag_t;

  type down_counts_t is array (natural range 0 to PASSES) of std_logic_vector(COUNT_BITS - 1 downto 0);

  type across_counts_t is array (natural range 0 to PASSES) of std_logic_vector(P * COUNT_BITS - 1 downto 0);

  -- In front of each pass, and behind the last.
  signal line_strobe : std_logic_vector(0 to PASSES);
  signal token_tags  : token_tags_t;
  signal line_tags   : line_tags_t;
  signal down        : down_counts_t;
  signal row_strobe  : std_logic_vector(0 to PASSES);
  signal row_tags    : row_tags_t;
  signal across      : across_counts_t;

begin

  --------------------------------------------------------------------------------------------------
  -- Along columns: a line is a step.

  line_strobe(0)            <= token.strobe;
  token_tags(0)(PIXEL)      <= token.pixel;
  token_tags(0)(LINE_FIRST) <= token.line_first;
  token_tags(0)(LINE_LAST)  <= token.line_last;
  line_tags(0)(IMAGE)       <= token.image;
  line_tags(0)(FRAME_FIRST) <= token.frame_first;

  line_tags(0)(line_tag_t'high downto SLICE_LOW) <= std_logic_vector(token.slice(SLICE_BITS - 1 downto 0));

  down(0) <= std_logic_vector(to_unsigned(1, COUNT_BITS));

  line_pass : for i in 0 to PASSES - 1 generate

    constant STAGE_SHIFTS : string   := pass_shifts(SHIFTS, i);
    constant IN_BITS      : positive := bits_for(largest_count(M, i));
    constant OUT_BITS     : positive := bits_for(largest_count(M, i + 1));

    signal slice   : unsigned(bits_for(slice_count(STAGE_SHIFTS) - 1) - 1 downto 0);
    signal advance : std_logic;

  begin

    first_pass : if i = 0 generate
      slice <= unsigned(line_tags(i)(line_tag_t'high downto SLICE_LOW));
    end generate first_pass;

    later_pass : if i > 0 generate
      slice <= (others => '0');
    end generate later_pass;

    advance <= token_tags(i)(PIXEL) and token_tags(i)(LINE_FIRST);

    stage : entity work.moving_sum_stage
      generic map (
        MICRO_IMAGE_SIZE => M,
        SHIFTS           => STAGE_SHIFTS,
        CENTRED          => CENTRED,
        FIXED_SLICE      => choose(i = 0, FIXED_SLICE, - 1),
        DEPTH            => 1,
        LANES            => 1,
        DATA_BITS        => IN_BITS,
        STORED           => false,
        SCALE_BITS       => 0,
        PRODUCT_MAX      => largest_count(M, i),
        SUM_MAX          => largest_count(M, i + 1),
        DROP_BITS        => 0,
        RESULT_BITS      => OUT_BITS,
        STEP_TAG_BITS    => line_tag_t'length,
        TOKEN_TAG_BITS   => token_tag_t'length
      )
      port map (
        clk           => clk,
        reset         => reset,
        strobe        => line_strobe(i),
        pixel         => advance,
        advance       => advance,
        first         => line_tags(i)(FRAME_FIRST),
        slice         => slice,
        data          => down(i)(IN_BITS - 1 downto 0),
        step_tag      => line_tags(i),
        token_tag     => token_tags(i),
        out_strobe    => line_strobe(i + 1),
        out_data      => down(i + 1)(OUT_BITS - 1 downto 0),
        out_step_tag  => line_tags(i + 1),
        out_token_tag => token_tags(i + 1)
      );

  end generate line_pass;

  --------------------------------------------------------------------------------------------------
  -- Along lines: a token is a step.

  row_strobe(0) <= line_strobe(PASSES);
  row_tags(0)   <= down(PASSES) & line_tags(PASSES)(line_tag_t'high downto SLICE_LOW) & token_tags(PASSES);

  one_for_each : for j in 0 to P - 1 generate
    across(0)((j + 1) * COUNT_BITS - 1 downto j * COUNT_BITS) <= std_logic_vector(to_unsigned(1, COUNT_BITS));
  end generate one_for_each;

  row_pass : for i in 0 to PASSES - 1 generate

    constant STAGE_SHIFTS : string   := pass_shifts(SHIFTS, i);
    constant IN_BITS      : positive := bits_for(largest_count(M, i));
    constant OUT_BITS     : positive := bits_for(largest_count(M, i + 1));

    signal slice  : unsigned(bits_for(slice_count(STAGE_SHIFTS) - 1) - 1 downto 0);
    signal first  : std_logic;
    signal counts : std_logic_vector(P * IN_BITS - 1 downto 0);
    signal sums   : std_logic_vector(P * OUT_BITS - 1 downto 0);

  begin

    first_pass : if i = 0 generate
      slice <= unsigned(row_tags(i)(DOWN_LOW - 1 downto ROW_SLICE_LOW));
    end generate first_pass;

    later_pass : if i > 0 generate
      slice <= (others => '0');
    end generate later_pass;

    first <= row_tags(i)(PIXEL) and row_tags(i)(LINE_FIRST);

    lane : for j in 0 to P - 1 generate

      -- What lies behind a line's last pixel is none.
      counts((j + 1) * IN_BITS - 1 downto j * IN_BITS) <= across(i)(j * COUNT_BITS + IN_BITS - 1 downto j * COUNT_BITS)
                                                          when row_tags(i)(LINE_LAST) = '0' or line_end(j) = '1' else
                                                          (others => '0');

      across(i + 1)(j * COUNT_BITS + OUT_BITS - 1 downto j * COUNT_BITS) <= sums((j + 1) * OUT_BITS - 1 downto
                                                                                 j * OUT_BITS);

    end generate lane;

    pixel_stage : if P = 1 generate

      stage : entity work.moving_sum_stage
        generic map (
          MICRO_IMAGE_SIZE => M,
          SHIFTS           => STAGE_SHIFTS,
          CENTRED          => CENTRED,
          FIXED_SLICE      => choose(i = 0, FIXED_SLICE, - 1),
          DEPTH            => 1,
          LANES            => 1,
          DATA_BITS        => IN_BITS,
          STORED           => false,
          SCALE_BITS       => 0,
          PRODUCT_MAX      => largest_count(M, i),
          SUM_MAX          => largest_count(M, i + 1),
          DROP_BITS        => 0,
          RESULT_BITS      => OUT_BITS,
          STEP_TAG_BITS    => row_tag_t'length,
          TOKEN_TAG_BITS   => 1
        )
        port map (
          clk           => clk,
          reset         => reset,
          strobe        => row_strobe(i),
          pixel         => '1',
          advance       => '1',
          first         => first,
          slice         => slice,
          data          => counts,
          step_tag      => row_tags(i),
          token_tag     => "0",
          out_strobe    => row_strobe(i + 1),
          out_data      => sums,
          out_step_tag  => row_tags(i + 1),
          out_token_tag => open
        );

    end generate pixel_stage;

    pixels_stage : if P > 1 generate

      stage : entity work.lane_stage
        generic map (
          MICRO_IMAGE_SIZE => M,
          SHIFTS           => STAGE_SHIFTS,
          CENTRED          => CENTRED,
          PIXELS_PER_CLOCK => P,
          CHANNELS         => 1,
          DATA_BITS        => IN_BITS,
          SUM_BITS         => OUT_BITS,
          TAG_BITS         => row_tag_t'length
        )
        port map (
          clk        => clk,
          reset      => reset,
          strobe     => row_strobe(i),
          first      => first,
          live       => row_tags(i)(PIXEL),
          slice      => slice,
          data       => counts,
          tag        => row_tags(i),
          out_strobe => row_strobe(i + 1),
          out_data   => sums,
          out_tag    => row_tags(i + 1)
        );

    end generate pixels_stage;

  end generate row_pass;

  multiply : process (clk) is

    variable of_line  : unsigned(COUNT_BITS - 1 downto 0);
    variable of_place : unsigned(COUNT_BITS - 1 downto 0);
    variable weight   : unsigned(WEIGHT_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then
      of_line := unsigned(row_tags(PASSES)(row_tag_t'high downto DOWN_LOW));

      for j in 0 to P - 1 loop

        of_place := unsigned(across(PASSES)((j + 1) * COUNT_BITS - 1 downto j * COUNT_BITS));
        weight   := resize(of_line * of_place, WEIGHT_BITS);

        weights((j + 1) * WEIGHT_BITS - 1 downto j * WEIGHT_BITS) <= std_logic_vector(weight);

      end loop;

    end if;

  end process multiply;

end architecture rtl;

-- SPDX-License-Identifier: Apache-2.0
-- How a deep memory is divided into blocks.
--
-- A tool would put a multiplexer between the block RAMs, whose outputs are late, and the first register. Blocks of a
-- division need no multiplexer inside: some have one size, then smaller ones take the rest. The division chosen takes
-- the fewest block RAMs, and among equals the fewest blocks.
--
-- All functions are evaluated at elaboration only.

library work;
use work.math_pkg.all;

package ram_blocks_pkg is

  -- How to divide: blocks of 2**full words, then a block for each bit that is left down to 2**least words, then
  -- one block for the rest.
  type division_t is record
    full  : natural range 9 to 31;
    least : natural range 9 to 31;
  end record division_t;

  -- The division of a memory of so many words of so many bits.
  function best_division (
    words : positive;
    width : positive
  ) return division_t;

  -- No memory has 2**30 words, so one block takes all of them.
  constant UNDIVIDED : division_t := (full => 30, least => 31);

  -- Number of blocks of a memory of so many words.
  function block_count (
    words    : positive;
    division : division_t
  ) return natural;

  -- The first word of a block.
  function block_base (
    index    : natural;
    words    : positive;
    division : division_t
  ) return natural;

  -- Words of the next block, with so many words left.
  function block_size (
    left     : natural;
    division : division_t
  ) return natural;

end package ram_blocks_pkg;

package body ram_blocks_pkg is

  -- A block RAM has 2**14 words of one bit to 2**9 words of 36.
  constant MOST_BITS  : positive := 14;
  constant LEAST_BITS : positive := 9;

  function block_size (
    left     : natural;
    division : division_t
  ) return natural is

    variable size : natural;

  begin

    -- The largest block that is still full; if none is, all that is left.
    size := left;

    for bits in division.least to division.full loop

      if left >= 2 ** bits then
        size := 2 ** bits;
      end if;

    end loop;

    return size;

  end function block_size;

  function block_base (
    index    : natural;
    words    : positive;
    division : division_t
  ) return natural is

    variable alike : natural;
    variable base  : natural;

  begin

    -- Blocks of one size are computed at once, because tools limit the length of loops.
    alike := words / 2 ** division.full;

    if index <= alike then
      return index * 2 ** division.full;
    end if;

    base := alike * 2 ** division.full;

    for i in alike + 1 to index loop

      base := base + block_size(words - base, division);

    end loop;

    return base;

  end function block_base;

  -- Block RAMs that a block takes.
  function block_rams (
    size  : positive;
    width : positive
  ) return positive is

    variable bits : positive;

  begin

    -- The smallest block RAM takes whatever has fewer words; more than 2**14 words lie in no block of a division.
    bits := 2 ** larger(MOST_BITS - larger(bits_for(size - 1), LEAST_BITS), 0);

    -- Words of eight bits have a parity bit, and wider ones in proportion.
    return (width - 1) / (bits + bits / 8) + 1;

  end function block_rams;

  -- Blocks of a division, and the block RAMs that they take.
  type cost_t is record
    blocks : natural;
    rams   : natural;
  end record cost_t;

  function cost_of (
    words    : positive;
    width    : positive;
    division : division_t
  ) return cost_t is

    variable base : natural;
    variable cost : cost_t;

  begin

    cost.blocks := words / 2 ** division.full;
    cost.rams   := 0;

    if cost.blocks > 0 then
      cost.rams := cost.blocks * block_rams(2 ** division.full, width);
    end if;

    base := cost.blocks * 2 ** division.full;

    -- A block for each bit, and one for the rest.
    for i in 0 to MOST_BITS - LEAST_BITS loop

      if base < words then
        cost.blocks := cost.blocks + 1;
        cost.rams   := cost.rams + block_rams(block_size(words - base, division), width);
        base        := base + block_size(words - base, division);
      end if;

    end loop;

    return cost;

  end function cost_of;

  function block_count (
    words    : positive;
    division : division_t
  ) return natural is

    constant COST : cost_t := cost_of(words, 1, division);

  begin

    return COST.blocks;

  end function block_count;

  function best_division (
    words : positive;
    width : positive
  ) return division_t is

    variable best   : division_t;
    variable fewest : cost_t;
    variable now    : cost_t;

  begin

    -- All divisions are tried at elaboration: there are 21.
    best   := (full => MOST_BITS, least => MOST_BITS);
    fewest := cost_of(words, width, best);

    for full in LEAST_BITS to MOST_BITS loop

      for least in LEAST_BITS to full loop

        now := cost_of(words, width, (full => full, least => least));

        if now.rams < fewest.rams or (now.rams = fewest.rams and now.blocks < fewest.blocks) then
          best   := (full => full, least => least);
          fewest := now;
        end if;

      end loop;

    end loop;

    return best;

  end function best_division;

end package body ram_blocks_pkg;

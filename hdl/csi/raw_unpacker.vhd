-- SPDX-License-Identifier: Apache-2.0
-- Makes words of pixels from the bytes of a line.
--
-- Bytes are appended to those that wait; when they fill a word, it leaves. At the end of a line the rest leaves as a
-- word with fewer pixels. Bytes that do not fill a unit of pixels are dropped.
--
-- Latency: 1 clock from the byte that completes a word, 2 clocks from a line's end. Throughput: LANES bytes each clock.
-- Equation: RAW8: pixel(n) = byte(n); RAW10: pixel(4k + i) = byte(5k + i) * 4 + bits 2i+1..2i of byte(5k + 4); RAW12:
--   pixel(2k + i) = byte(3k + i) * 16 + bits 4i+3..4i of byte(3k + 2).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.csi_pkg.all;
use work.math_pkg.all;

entity raw_unpacker is
  generic (
    LANES      : positive range 1 to 4;
    PIXEL_BITS : positive range 8 to 12;
    -- Pixels of a word (pixels_of_word).
    WORD_PIXELS : positive range 1 to 8
  );
  port (
    clk : in    std_logic;
    -- Bytes of a line, and how many; the line has ended. A clock without bytes must follow a line's end.
    payload      : in    payload_t;
    payload_data : in    std_logic_vector(8 * LANES - 1 downto 0);
    -- A word: its pixels, the first one in the low bits; the number of its last pixel; with word.ends no other word of
    -- its line follows, and this one may be empty.
    word      : out   unpacked_t;
    word_data : out   std_logic_vector(WORD_PIXELS * PIXEL_BITS - 1 downto 0)
  );
end entity raw_unpacker;

architecture rtl of raw_unpacker is

  -- Bytes of a unit (the smallest group of pixels that fills whole bytes), and of a word.
  constant UNIT       : positive := unit_bytes(PIXEL_BITS);
  constant WORD_BYTES : positive := WORD_PIXELS / unit_pixels(PIXEL_BITS) * UNIT;

  -- Bytes that wait for a word, and how many; the end of a line is to be written; the full word.
  signal kept   : std_logic_vector(8 * WORD_BYTES - 1 downto 0) := (others => '0');
  signal fill   : natural range 0 to 11                         := 0;
  signal finish : std_logic                                     := '0';
  signal full   : std_logic_vector(8 * WORD_BYTES - 1 downto 0) := (others => '0');

begin

  -- The word is kept as bytes, and unpacked by wires behind the register.
  word_data <= unpacked(full, PIXEL_BITS, WORD_PIXELS);

  gather : process (clk) is

    variable joined : std_logic_vector(8 * (WORD_BYTES + LANES) - 1 downto 0);
    variable total  : natural range 0 to 15;

  begin

    -- synthesis translate_off
    assert not (rising_edge(clk) and finish = '1' and payload.valid = '1')
      report "raw_unpacker: bytes came in the clock behind a line's end, and are lost"
      severity failure;
    -- synthesis translate_on

    if rising_edge(clk) then
      -- Bytes that wait, from the low end on, and the new bytes behind them.
      joined                              := (others => '0');
      joined(8 * WORD_BYTES - 1 downto 0) := kept;

      for f in 0 to WORD_BYTES - 1 loop

        if fill = f then
          joined(8 * (f + LANES) - 1 downto 8 * f) := payload_data;
        end if;

      end loop;

      word.valid <= '0';
      word.ends  <= finish;
      -- A word is full except at the end of a line.
      word.last <= WORD_PIXELS - 1;
      finish    <= payload.ends;
      total     := fill + payload.bytes;
      if payload.valid = '1' then
        -- In both cases: a word that is not full is not valid, so its content does not matter.
        full <= joined(8 * WORD_BYTES - 1 downto 0);
        -- More bytes than a word: the rest waits for the next one.
        if total >= WORD_BYTES then
          word.valid                   <= '1';
          kept(8 * LANES - 1 downto 0) <= joined(8 * (WORD_BYTES + LANES) - 1 downto 8 * WORD_BYTES);
          fill                         <= total - WORD_BYTES;
        else
          kept <= joined(8 * WORD_BYTES - 1 downto 0);
          fill <= total;
        end if;
      elsif finish = '1' then
        -- A clock behind the last bytes, which may have filled a word themselves. The parser never sends bytes in this
        -- clock.
        full <= kept;
        fill <= 0;

        -- Whole units among the bytes that are left. Part of a unit is a line cut short, and none of its pixels is
        -- complete.
        for n in 1 to WORD_BYTES / UNIT loop

          if fill >= n * UNIT then
            word.valid <= '1';
            word.last  <= n * unit_pixels(PIXEL_BITS) - 1;
          end if;

        end loop;

      end if;
    end if;

  end process gather;

end architecture rtl;

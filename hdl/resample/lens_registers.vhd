-- SPDX-License-Identifier: Apache-2.0
-- Takes calibrations from the load port. Each frame gets the registers of the newest calibration that was committed
-- when its first pixel was taken, however long that pixel waits before the frame begins to come in.
--
-- A memory of four banks holds the newest calibration, the calibration of the frame whose first pixel was taken last,
-- that of the frame that began to come in last, and the words that are being written. A write therefore never touches
-- what a frame uses or will use, an interrupted load changes nothing, and a commit replaces a calibration that no frame
-- has used. If several frames wait at once (frames so short that two fit into the buffers in front), all have the
-- calibration of the last of them.
--
-- A commit without new words repeats the commit before and changes nothing. A commit after only some of the words is a
-- fault and waits for the missing words. Words survive a reset.
--
-- Latency: REGISTER_COUNT + 1 clocks from copy to copied. Throughput: a word each clock.
-- Equation: registers = the bank `used`, word by word, while copy = '1'.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;

entity lens_registers is
  generic (
    -- Registers of a calibration, from address 0 on.
    NEEDED : positive range 1 to REGISTER_COUNT
  );
  port (
    clk : in    std_logic;
    -- The load port; only registers and commits are used here.
    load : in    load_t;
    -- High for one clock: a commit without all registers.
    incomplete : out   std_logic;
    -- frame_accepted: the first pixel of a frame is taken; the frame has the calibration committed by now. frame_start:
    -- the frame begins to come in, at least a clock later.
    frame_accepted : in    std_logic;
    frame_start    : in    std_logic;
    -- copy: copies the registers of the frame that began last, while high; the frame before has left. copied: all are
    -- copied.
    copy      : in    std_logic;
    copied    : out   std_logic;
    registers : out   registers_t
  );
end entity lens_registers;

architecture rtl of lens_registers is

  subtype bank_t is unsigned(1 downto 0);

  -- Bits of a register's number.
  constant NUMBER_BITS : positive := 4;

  subtype written_t is std_logic_vector(2 ** NUMBER_BITS - 1 downto 0);

  -- A bank that is none of the three.
  function other_than (
    a : bank_t;
    b : bank_t;
    c : bank_t
  ) return bank_t is
  begin

    for i in 0 to 2 loop

      if a /= i and b /= i and c /= i then
        return to_unsigned(i, 2);
      end if;

    end loop;

    return "11";

  end function other_than;

  -- Banks: of the newest calibration; of the frame whose first pixel was taken last; of the frame that is processed;
  -- the one that is written. written: registers written into it so far.
  signal newest  : bank_t    := "00";
  signal waiting : bank_t    := "00";
  signal used    : bank_t    := "00";
  signal writing : bank_t    := "01";
  signal written : written_t := (others => '0');
  -- The copy: how many registers are copied, and the memory's word.
  signal count       : natural range 0 to REGISTER_COUNT := 0;
  signal write_now   : std_logic;
  signal number      : unsigned(NUMBER_BITS - 1 downto 0);
  signal write_place : unsigned(5 downto 0);
  signal read_place  : unsigned(5 downto 0);
  signal word        : std_logic_vector(31 downto 0);
  signal held        : registers_t                       := (others => (others => '0'));

begin

  write_now   <= writes(load, LOAD_KIND_REGISTER);
  number      <= unsigned(load.address(NUMBER_BITS - 1 downto 0));
  write_place <= writing & number;
  read_place  <= used & to_unsigned(count, NUMBER_BITS);
  registers   <= held;
  copied      <= '1' when count = REGISTER_COUNT else
                 '0';

  choose_banks : process (clk) is

    variable newest_now  : bank_t;
    variable waiting_now : bank_t;
    variable used_now    : bank_t;
    variable missing     : std_logic;
    variable commits     : boolean;

  begin

    if rising_edge(clk) then
      if write_now = '1' then
        written(to_integer(number)) <= '1';
      end if;

      missing := '0';

      for i in 0 to NEEDED - 1 loop

        missing := missing or not written(i);

      end loop;

      commits    := writes(load, LOAD_KIND_COMMIT) = '1' and missing = '0';
      incomplete <= to_logic(writes(load, LOAD_KIND_COMMIT) = '1' and missing = '1' and unsigned(written) /= 0);

      newest_now := newest;
      if commits then
        newest_now := writing;
      end if;
      -- A frame's bank is kept in `waiting` from its first pixel until it begins, and in `used` until its registers are
      -- copied.
      waiting_now := waiting;
      if frame_accepted = '1' then
        waiting_now := newest_now;
      end if;
      used_now := used;
      if frame_start = '1' then
        used_now := waiting;
      end if;

      newest  <= newest_now;
      waiting <= waiting_now;
      used    <= used_now;
      -- With four banks one is always free to write: software never waits, and no frame gets half a grid.
      if commits then
        writing <= other_than(newest_now, waiting_now, used_now);
        written <= (others => '0');
      end if;
    end if;

  end process choose_banks;

  copy_words : process (clk) is
  begin

    if rising_edge(clk) then
      -- The memory answers a clock later.
      count <= 0;
      if copy = '1' and count /= REGISTER_COUNT then
        count <= count + 1;
      end if;

      for i in 0 to REGISTER_COUNT - 1 loop

        if copy = '1' and count = i + 1 then
          held(i) <= word;
        end if;

      end loop;

    end if;

  end process copy_words;

  -- One memory has all banks: the registers are copied out once a frame, one word each clock.
  words : entity work.ram_simple_dual_port
    generic map (
      WIDTH        => 32,
      WORDS        => 64,
      READ_LATENCY => 1
    )
    port map (
      clk           => clk,
      write_enable  => write_now,
      write_address => write_place,
      write_data    => load.data(31 downto 0),
      read_address  => read_place,
      read_data     => word
    );

  -- Simulation stops if a frame begins that was not accepted: it would take another frame's calibration.
  watch_frames : process (clk) is

    variable waits : natural := 0;

  begin

    -- synthesis translate_off
    if rising_edge(clk) then
      assert not (frame_start = '1' and waits = 0)
        report "lens_registers: a frame began that was not accepted before"
        severity failure;
      if frame_accepted = '1' then
        waits := waits + 1;
      end if;
      if frame_start = '1' then
        waits := waits - 1;
      end if;
    end if;

  -- synthesis translate_on

  end process watch_frames;

end architecture rtl;

-- SPDX-License-Identifier: Apache-2.0
-- Takes calibrations from the load port. Each frame gets the registers of the newest one that was committed before the
-- frame began.
--
-- A memory of three banks holds the newest calibration, that of the frame that began last, and the words that are being
-- written, so a write never touches what a frame uses or will use. A load that is interrupted therefore changes
-- nothing, and a committed one replaces one that no frame has used yet.
--
-- A commit without new words repeats the one before and changes nothing. A commit after only some of the words is a
-- fault and waits for the missing ones. Words that were written survive a reset.
--
-- Latency: REGISTER_COUNT + 1 clocks from copy to copied. Throughput: a word each clock.
-- Equation: registers = the bank `used`, word by word, while copy = '1'.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.resample_pkg.all;

entity lens_registers is
  generic (
    -- Registers of a calibration, from address 0 on.
    NEEDED : positive range 1 to REGISTER_COUNT
  );
  port (
    clk : in    std_logic;
    -- The load port; of it the registers and the commit.
    load : in    load_t;
    -- For a clock: a commit without all registers.
    incomplete : out   std_logic;
    -- A frame begins to come in: it has what is committed by now.
    frame_start : in    std_logic;
    -- Copies the registers of the frame that began last, until they are copied; the frame before has left.
    copy      : in    std_logic;
    copied    : out   std_logic;
    registers : out   registers_t
  );
end entity lens_registers;

architecture rtl of lens_registers is

  subtype bank_t is unsigned(1 downto 0);

  -- Of a register's number.
  constant NUMBER_BITS : positive := 4;

  subtype written_t is std_logic_vector(2 ** NUMBER_BITS - 1 downto 0);

  -- The bank that is neither.
  function other_than (
    a : bank_t;
    b : bank_t
  ) return bank_t is
  begin

    if a /= 0 and b /= 0 then
      return "00";
    elsif a /= 1 and b /= 1 then
      return "01";
    end if;

    return "10";

  end function other_than;

  -- Bank of the newest calibration, of the frame on work, and the one that is written; registers
  -- written into it so far.
  signal newest  : bank_t    := "00";
  signal used    : bank_t    := "00";
  signal writing : bank_t    := "01";
  signal written : written_t := (others => '0');
  -- The copy: how many are out, and the memory's word.
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

    variable used_now : bank_t;
    variable missing  : std_logic;

  begin

    if rising_edge(clk) then
      used_now := used;
      -- A frame that begins in the clock of a commit has the grid before it: it is not sure to have the new one
      -- whole.
      if frame_start = '1' then
        used_now := newest;
      end if;
      used <= used_now;

      if write_now = '1' then
        written(to_integer(number)) <= '1';
      end if;

      missing := '0';

      for i in 0 to NEEDED - 1 loop

        missing := missing or not written(i);

      end loop;

      incomplete <= '0';
      -- Three banks: one that the frame on work has, the newest, and one to write. So software never waits and no
      -- frame gets half a grid.
      if writes(load, LOAD_KIND_COMMIT) = '1' then
        if missing = '0' then
          newest  <= writing;
          writing <= other_than(writing, used_now);
          written <= (others => '0');
        elsif unsigned(written) /= 0 then
          incomplete <= '1';
        end if;
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

  -- One memory for all banks: the registers are copied out once a frame, a word each clock.
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

end architecture rtl;

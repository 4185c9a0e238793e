-- The EDID of the HDMI input, and the known modes in a monitor's; built by scripts/build_hdl.py.
--
-- Offered: 640x480p60, 800x600p60, 1024x768p60, 1280x720p50, 1280x720p60;
-- with a fixed PLL those of its range, 1280x720p30 besides.
-- A build serves the block whose modes fit its longest line and its PLL; no
-- extension, so sources send DVI.

library ieee;
use ieee.std_logic_1164.all;

package edid_pkg is

  constant EDID_BYTES : positive := 128;

  type edid_columns_t is array (0 to 9) of positive;

  -- Longest line of each EDID.
  constant EDID_COLUMNS : edid_columns_t :=
  (
    0 => 640,
    1 => 800,
    2 => 1024,
    3 => 1280,
    4 => 640,
    5 => 1280,
    6 => 800,
    7 => 1280,
    8 => 1024,
    9 => 1280
  );

  type edid_ranges_t is array (0 to 9) of natural;

  -- Pixel clocks of each EDID, see CLOCK_RANGE of hdmi_control.
  constant EDID_RANGES : edid_ranges_t :=
  (
    0 => 0,
    1 => 0,
    2 => 0,
    3 => 0,
    4 => 4,
    5 => 4,
    6 => 3,
    7 => 3,
    8 => 2,
    9 => 2
  );

  -- The bytes of all of them one after the other, the first one at the left.
  subtype edids_t is std_logic_vector(0 to 10239);

  constant EDIDS : edids_t := x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505420000001010101010101010101" &
                              x"010101010101D50980A020E02D101060" &
                              x"A2000000000000180000001000000000" &
                              x"00000000000000000000000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"003B3C1F2003000A202020202020008F" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505421000001010101010101010101" &
                              x"010101010101A00F200031581C202880" &
                              x"140000000000001ED50980A020E02D10" &
                              x"1060A200000000000018000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"003B3D1F2604000A2020202020200028" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505421080001010101010101010101" &
                              x"01010101010164190040410026301888" &
                              x"3600000000000018D50980A020E02D10" &
                              x"1060A200000000000018000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"003B3D1F3107000A202020202020003E" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505421080001010101010101010101" &
                              x"010101010101011D007251D01E206E28" &
                              x"550000000000001E011D00BC52D01E20" &
                              x"B828554000000000001E000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"00323D1F3108000A2020202020200028" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505420000001010101010101010101" &
                              x"010101010101D50980A020E02D101060" &
                              x"A2000000000000180000001000000000" &
                              x"00000000000000000000000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"003B3C1F2003000A202020202020008F" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505420000001010101010101010101" &
                              x"010101010101800E007251D01E206E28" &
                              x"550000000000001ED50980A020E02D10" &
                              x"1060A200000000000018000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"001E3C162004000A202020202020005C" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505401000001010101010101010101" &
                              x"010101010101A00F200031581C202880" &
                              x"140000000000001E0000001000000000" &
                              x"00000000000000000000000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"003C3D252604000A2020202020200096" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505401000001010101010101010101" &
                              x"010101010101800E007251D01E206E28" &
                              x"550000000000001EA00F200031581C20" &
                              x"2880140000000000001E000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"001E3D162604000A202020202020006B" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505400080001010101010101010101" &
                              x"01010101010164190040410026301888" &
                              x"36000000000000180000001000000000" &
                              x"00000000000000000000000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"003C3D303107000A20202020202000A2" &
                              x"00FFFFFFFFFFFF004186450000000000" &
                              x"00220103810000780EEE91A3544C9926" &
                              x"0F505400080001010101010101010101" &
                              x"010101010101011D007251D01E206E28" &
                              x"550000000000001E011D00BC52D01E20" &
                              x"B828554000000000001E000000FC0070" &
                              x"6C656E6F6669720A20202020000000FD" &
                              x"00323D253108000A2020202020200043";

  -- A mode as an EDID names it: bits of bytes 35 and 36 (established timings), both bytes of a
  -- standard timing, code of CEA-861; 0: it has none.

  type known_mode_t is record
    columns     : positive;
    rows        : positive;
    rate        : positive;
    established : std_logic_vector(15 downto 0);
    standard    : std_logic_vector(15 downto 0);
    vic         : std_logic_vector(6 downto 0);
  end record known_mode_t;

  type known_modes_t is array (0 to 4) of known_mode_t;

  -- Rates in 0.1 Hz.
  constant KNOWN_MODES : known_modes_t :=
  (
    0 => (640, 480, 599, x"2000", x"3140", "0000001"),
    1 => (800, 600, 603, x"0100", x"4540", "0000000"),
    2 => (1024, 768, 600, x"0008", x"6140", "0000000"),
    3 => (1280, 720, 500, x"0000", x"0000", "0010011"),
    4 => (1280, 720, 600, x"0000", x"81C0", "0000100")
  );

end package edid_pkg;

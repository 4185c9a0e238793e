-- A focal stack and its depth index, one behind the other: what the pumps of both simulate. Synthesisable.
--
-- stack_* shows the slices on their way from one to the other.

library ieee;
use ieee.std_logic_1164.all;

library work;
use work.refocus_pkg.all;

entity stack_and_index is
  generic (
    MICRO_IMAGE_SIZE : positive := 2;
    SHIFTS           : string   := "0";
    CENTRED          : boolean  := true;
    MAX_COLUMNS      : positive := 2048;
    CHANNELS         : positive := 1;
    PIXEL_BITS       : positive := 8;
    INPUT_LINES      : positive := 1;
    RADIUS           : natural  := 1
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    columns       : in    std_logic_vector(15 downto 0);
    rows          : in    std_logic_vector(15 downto 0);
    s_axis_tvalid : in    std_logic;
    s_axis_tready : out   std_logic;
    s_axis_tdata  : in    std_logic_vector(CHANNELS * PIXEL_BITS - 1 downto 0);
    s_axis_tuser  : in    std_logic_vector(0 downto 0);
    s_axis_tlast  : in    std_logic;
    stack_tvalid  : out   std_logic;
    stack_tready  : out   std_logic;
    stack_tdata   : out   std_logic_vector(slice_count(SHIFTS) * CHANNELS * PIXEL_BITS - 1 downto 0);
    stack_tuser   : out   std_logic_vector(0 downto 0);
    stack_tlast   : out   std_logic;
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(CHANNELS * PIXEL_BITS + 7 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic;
    error_flags   : out   std_logic_vector(4 downto 0)
  );
end entity stack_and_index;

architecture rtl of stack_and_index is

  constant SLICES : positive := slice_count(SHIFTS);

  signal slices_valid : std_logic;
  signal slices_ready : std_logic;
  signal slices_data  : std_logic_vector(SLICES * CHANNELS * PIXEL_BITS - 1 downto 0);
  signal slices_user  : std_logic_vector(0 downto 0);
  signal slices_last  : std_logic;
  signal stack_errors : std_logic_vector(4 downto 0);
  signal index_errors : std_logic_vector(4 downto 0);

begin

  stack : entity work.focal_stack
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      MAX_COLUMNS      => MAX_COLUMNS,
      CHANNELS         => CHANNELS,
      PIXEL_BITS       => PIXEL_BITS,
      INPUT_LINES      => INPUT_LINES
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns,
      rows          => rows,
      s_axis_tvalid => s_axis_tvalid,
      s_axis_tready => s_axis_tready,
      s_axis_tdata  => s_axis_tdata,
      s_axis_tuser  => s_axis_tuser,
      s_axis_tlast  => s_axis_tlast,
      m_axis_tvalid => slices_valid,
      m_axis_tready => slices_ready,
      m_axis_tdata  => slices_data,
      m_axis_tuser  => slices_user,
      m_axis_tlast  => slices_last,
      error_flags   => stack_errors,
      error_clear   => '0'
    );

  index : entity work.depth_index
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SLICES           => SLICES,
      RADIUS           => RADIUS,
      MAX_COLUMNS      => MAX_COLUMNS,
      CHANNELS         => CHANNELS,
      PIXEL_BITS       => PIXEL_BITS
    )
    port map (
      clk           => clk,
      reset         => reset,
      columns       => columns,
      rows          => rows,
      s_axis_tvalid => slices_valid,
      s_axis_tready => slices_ready,
      s_axis_tdata  => slices_data,
      s_axis_tuser  => slices_user,
      s_axis_tlast  => slices_last,
      m_axis_tvalid => m_axis_tvalid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => m_axis_tdata,
      m_axis_tuser  => m_axis_tuser,
      m_axis_tlast  => m_axis_tlast,
      error_flags   => index_errors,
      error_clear   => '0'
    );

  stack_tvalid <= slices_valid;
  stack_tready <= slices_ready;
  stack_tdata  <= slices_data;
  stack_tuser  <= slices_user;
  stack_tlast  <= slices_last;
  error_flags  <= stack_errors or index_errors;

end architecture rtl;

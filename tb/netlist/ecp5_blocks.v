// SPDX-License-Identifier: Apache-2.0
// Models of the ECP5's hard blocks that Yosys has none of, for its netlists: PLL, delay lines, registers at the pins
// (as hdl/sim/ecp5u, from the same documents), block RAM (FPGA-TN-02204), multiplier. Enough for what the boards use.
`timescale 1ps / 1ps

// CLKOP = CLKI * CLKFB_DIV, CLKOS = VCO / CLKOS_DIV, both ratios to CLKI whole numbers.
module EHXPLLL (
  input CLKI, CLKFB, RST, STDBY, PLLWAKESYNC, PHASESEL0, PHASESEL1, PHASEDIR, PHASESTEP, PHASELOADREG,
  input ENCLKOP, ENCLKOS, ENCLKOS2, ENCLKOS3,
  output reg CLKOP, output reg CLKOS, output CLKOS2, CLKOS3, output reg LOCK, output INTLOCK, REFCLK, CLKINTFB
);
  parameter CLKI_DIV = 1;
  parameter CLKFB_DIV = 1;
  parameter CLKOP_DIV = 8;
  parameter CLKOS_DIV = 8;
  parameter CLKOP_CPHASE = 0;
  parameter CLKOS_CPHASE = 0;
  parameter CLKOS_ENABLE = "DISABLED";
  parameter FEEDBK_PATH = "CLKOP";
  parameter INT_LOCK_STICKY = "ENABLED";
  parameter PLLRST_ENA = "DISABLED";
  localparam LOCK_CYCLES = 32;
  localparam OS_RATIO = CLKFB_DIV * CLKOP_DIV / CLKOS_DIV;

  integer cycles, i, j;
  time last, period;
  wire reset = RST && PLLRST_ENA == "ENABLED";

  initial begin
    CLKOP = 0;
    CLKOS = 0;
    LOCK = 0;
    cycles = 0;
    last = 0;
    period = 0;
    if (CLKI_DIV != 1 || OS_RATIO * CLKOS_DIV != CLKFB_DIV * CLKOP_DIV) begin
      $display("EHXPLLL: ratios that the model does not know");
      $finish(0);
    end
  end

  always @(posedge CLKI or posedge reset)
    if (reset) begin
      cycles = 0;
      LOCK <= 0;
    end else begin
      period = $time - last;
      last = $time;
      cycles = cycles + 1;
      if (cycles > LOCK_CYCLES)
        LOCK <= 1;
    end

  always @(posedge CLKI)
    if (cycles > 2)
      for (i = 0; i < 2 * CLKFB_DIV; i = i + 1) begin
        CLKOP = ~i[0];
        if (i != 2 * CLKFB_DIV - 1) #(period / (2 * CLKFB_DIV));
      end

  always @(posedge CLKI)
    if (cycles > 2)
      for (j = 0; j < 2 * OS_RATIO; j = j + 1) begin
        CLKOS = ~j[0];
        if (j != 2 * OS_RATIO - 1) #(period / (2 * OS_RATIO));
      end

  assign {CLKOS2, CLKOS3, CLKINTFB} = 0;
  assign INTLOCK = LOCK;
  assign REFCLK = CLKI;
endmodule

// 128 taps of 25 ps; bits are longer than that.
module DELAYF (input A, LOADN, MOVE, DIRECTION, output reg Z, output CFLAG);
  parameter DEL_MODE = "USER_DEFINED";
  parameter DEL_VALUE = 0;
  integer taps;
  initial begin
    taps = DEL_VALUE;
    Z = 0;
  end
  reg level;
  always @(A) begin
    level = A;
    #(25 * taps) Z = level;
  end
  always @(negedge MOVE or negedge LOADN)
    if (!LOADN) taps = DEL_VALUE;
    else if (!DIRECTION && taps < 127) taps = taps + 1;
    else if (DIRECTION && taps > 0) taps = taps - 1;
  assign CFLAG = taps == 0 || taps == 127;
endmodule

// Both bits come out with the rising edge behind them.
module IDDRX1F (input D, SCLK, RST, output reg Q0, Q1);
  parameter GSR = "ENABLED";
  reg first, second;
  always @(negedge SCLK) second <= D;
  always @(posedge SCLK) begin
    first <= D;
    Q0 <= first;
    Q1 <= second;
  end
endmodule

// D0 while the clock is high, D1 while it is low, both taken with its rising edge.
module ODDRX1F (input D0, D1, SCLK, RST, output Q);
  parameter GSR = "ENABLED";
  reg high, low;
  always @(posedge SCLK or posedge RST)
    if (RST) {high, low} <= 0;
    else {high, low} <= {D0, D1};
  assign Q = SCLK ? high : low;
endmodule

// Words of 9, 18 or 36 bits, a byte of 9 bits written where its bit of the address says so; each port gives the word
// that was there before. A word of 36 bits is written through port A and read through port B.
module DP16KD (
  input CLKA, WEA, CEA, OCEA, RSTA, CSA0, CSA1, CSA2,
  input
  ADA0, ADA1, ADA2, ADA3, ADA4, ADA5, ADA6, ADA7, ADA8, ADA9, ADA10, ADA11, ADA12, ADA13,
  input
  DIA0, DIA1, DIA2, DIA3, DIA4, DIA5, DIA6, DIA7, DIA8,
  DIA9, DIA10, DIA11, DIA12, DIA13, DIA14, DIA15, DIA16, DIA17,
  input CLKB, WEB, CEB, OCEB, RSTB, CSB0, CSB1, CSB2,
  input
  ADB0, ADB1, ADB2, ADB3, ADB4, ADB5, ADB6, ADB7, ADB8, ADB9, ADB10, ADB11, ADB12, ADB13,
  input
  DIB0, DIB1, DIB2, DIB3, DIB4, DIB5, DIB6, DIB7, DIB8,
  DIB9, DIB10, DIB11, DIB12, DIB13, DIB14, DIB15, DIB16, DIB17,
  output
  DOA0, DOA1, DOA2, DOA3, DOA4, DOA5, DOA6, DOA7, DOA8,
  DOA9, DOA10, DOA11, DOA12, DOA13, DOA14, DOA15, DOA16, DOA17,
  output
  DOB0, DOB1, DOB2, DOB3, DOB4, DOB5, DOB6, DOB7, DOB8,
  DOB9, DOB10, DOB11, DOB12, DOB13, DOB14, DOB15, DOB16, DOB17
);
  parameter DATA_WIDTH_A = 18;
  parameter DATA_WIDTH_B = 18;
  parameter REGMODE_A = "NOREG";
  parameter REGMODE_B = "NOREG";
  parameter RESETMODE = "SYNC";
  parameter ASYNC_RESET_RELEASE = "SYNC";
  parameter CSDECODE_A = "0b000";
  parameter CSDECODE_B = "0b000";
  parameter WRITEMODE_A = "NORMAL";
  parameter WRITEMODE_B = "NORMAL";
  parameter CLKAMUX = "CLKA";
  parameter CLKBMUX = "CLKB";
  parameter GSR = "AUTO";
  parameter [319:0] INITVAL_00 = 0;
  parameter [319:0] INITVAL_01 = 0;
  parameter [319:0] INITVAL_02 = 0;
  parameter [319:0] INITVAL_03 = 0;
  parameter [319:0] INITVAL_04 = 0;
  parameter [319:0] INITVAL_05 = 0;
  parameter [319:0] INITVAL_06 = 0;
  parameter [319:0] INITVAL_07 = 0;
  parameter [319:0] INITVAL_08 = 0;
  parameter [319:0] INITVAL_09 = 0;
  parameter [319:0] INITVAL_0A = 0;
  parameter [319:0] INITVAL_0B = 0;
  parameter [319:0] INITVAL_0C = 0;
  parameter [319:0] INITVAL_0D = 0;
  parameter [319:0] INITVAL_0E = 0;
  parameter [319:0] INITVAL_0F = 0;
  parameter [319:0] INITVAL_10 = 0;
  parameter [319:0] INITVAL_11 = 0;
  parameter [319:0] INITVAL_12 = 0;
  parameter [319:0] INITVAL_13 = 0;
  parameter [319:0] INITVAL_14 = 0;
  parameter [319:0] INITVAL_15 = 0;
  parameter [319:0] INITVAL_16 = 0;
  parameter [319:0] INITVAL_17 = 0;
  parameter [319:0] INITVAL_18 = 0;
  parameter [319:0] INITVAL_19 = 0;
  parameter [319:0] INITVAL_1A = 0;
  parameter [319:0] INITVAL_1B = 0;
  parameter [319:0] INITVAL_1C = 0;
  parameter [319:0] INITVAL_1D = 0;
  parameter [319:0] INITVAL_1E = 0;
  parameter [319:0] INITVAL_1F = 0;
  parameter [319:0] INITVAL_20 = 0;
  parameter [319:0] INITVAL_21 = 0;
  parameter [319:0] INITVAL_22 = 0;
  parameter [319:0] INITVAL_23 = 0;
  parameter [319:0] INITVAL_24 = 0;
  parameter [319:0] INITVAL_25 = 0;
  parameter [319:0] INITVAL_26 = 0;
  parameter [319:0] INITVAL_27 = 0;
  parameter [319:0] INITVAL_28 = 0;
  parameter [319:0] INITVAL_29 = 0;
  parameter [319:0] INITVAL_2A = 0;
  parameter [319:0] INITVAL_2B = 0;
  parameter [319:0] INITVAL_2C = 0;
  parameter [319:0] INITVAL_2D = 0;
  parameter [319:0] INITVAL_2E = 0;
  parameter [319:0] INITVAL_2F = 0;
  parameter [319:0] INITVAL_30 = 0;
  parameter [319:0] INITVAL_31 = 0;
  parameter [319:0] INITVAL_32 = 0;
  parameter [319:0] INITVAL_33 = 0;
  parameter [319:0] INITVAL_34 = 0;
  parameter [319:0] INITVAL_35 = 0;
  parameter [319:0] INITVAL_36 = 0;
  parameter [319:0] INITVAL_37 = 0;
  parameter [319:0] INITVAL_38 = 0;
  parameter [319:0] INITVAL_39 = 0;
  parameter [319:0] INITVAL_3A = 0;
  parameter [319:0] INITVAL_3B = 0;
  parameter [319:0] INITVAL_3C = 0;
  parameter [319:0] INITVAL_3D = 0;
  parameter [319:0] INITVAL_3E = 0;
  parameter [319:0] INITVAL_3F = 0;

  // Bytes of 9 bits; two of them are 18 bits of an initial value, whose words are 20 bits apart.
  reg [8:0] bytes [0:2047];
  integer i;
  initial begin
    for (i = 0; i < 16; i = i + 1) {bytes[0 + 2 * i + 1], bytes[0 + 2 * i]} = INITVAL_00[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[32 + 2 * i + 1], bytes[32 + 2 * i]} = INITVAL_01[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[64 + 2 * i + 1], bytes[64 + 2 * i]} = INITVAL_02[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[96 + 2 * i + 1], bytes[96 + 2 * i]} = INITVAL_03[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[128 + 2 * i + 1], bytes[128 + 2 * i]} = INITVAL_04[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[160 + 2 * i + 1], bytes[160 + 2 * i]} = INITVAL_05[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[192 + 2 * i + 1], bytes[192 + 2 * i]} = INITVAL_06[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[224 + 2 * i + 1], bytes[224 + 2 * i]} = INITVAL_07[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[256 + 2 * i + 1], bytes[256 + 2 * i]} = INITVAL_08[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[288 + 2 * i + 1], bytes[288 + 2 * i]} = INITVAL_09[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[320 + 2 * i + 1], bytes[320 + 2 * i]} = INITVAL_0A[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[352 + 2 * i + 1], bytes[352 + 2 * i]} = INITVAL_0B[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[384 + 2 * i + 1], bytes[384 + 2 * i]} = INITVAL_0C[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[416 + 2 * i + 1], bytes[416 + 2 * i]} = INITVAL_0D[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[448 + 2 * i + 1], bytes[448 + 2 * i]} = INITVAL_0E[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[480 + 2 * i + 1], bytes[480 + 2 * i]} = INITVAL_0F[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[512 + 2 * i + 1], bytes[512 + 2 * i]} = INITVAL_10[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[544 + 2 * i + 1], bytes[544 + 2 * i]} = INITVAL_11[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[576 + 2 * i + 1], bytes[576 + 2 * i]} = INITVAL_12[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[608 + 2 * i + 1], bytes[608 + 2 * i]} = INITVAL_13[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[640 + 2 * i + 1], bytes[640 + 2 * i]} = INITVAL_14[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[672 + 2 * i + 1], bytes[672 + 2 * i]} = INITVAL_15[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[704 + 2 * i + 1], bytes[704 + 2 * i]} = INITVAL_16[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[736 + 2 * i + 1], bytes[736 + 2 * i]} = INITVAL_17[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[768 + 2 * i + 1], bytes[768 + 2 * i]} = INITVAL_18[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[800 + 2 * i + 1], bytes[800 + 2 * i]} = INITVAL_19[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[832 + 2 * i + 1], bytes[832 + 2 * i]} = INITVAL_1A[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[864 + 2 * i + 1], bytes[864 + 2 * i]} = INITVAL_1B[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[896 + 2 * i + 1], bytes[896 + 2 * i]} = INITVAL_1C[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[928 + 2 * i + 1], bytes[928 + 2 * i]} = INITVAL_1D[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[960 + 2 * i + 1], bytes[960 + 2 * i]} = INITVAL_1E[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[992 + 2 * i + 1], bytes[992 + 2 * i]} = INITVAL_1F[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1024 + 2 * i + 1], bytes[1024 + 2 * i]} = INITVAL_20[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1056 + 2 * i + 1], bytes[1056 + 2 * i]} = INITVAL_21[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1088 + 2 * i + 1], bytes[1088 + 2 * i]} = INITVAL_22[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1120 + 2 * i + 1], bytes[1120 + 2 * i]} = INITVAL_23[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1152 + 2 * i + 1], bytes[1152 + 2 * i]} = INITVAL_24[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1184 + 2 * i + 1], bytes[1184 + 2 * i]} = INITVAL_25[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1216 + 2 * i + 1], bytes[1216 + 2 * i]} = INITVAL_26[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1248 + 2 * i + 1], bytes[1248 + 2 * i]} = INITVAL_27[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1280 + 2 * i + 1], bytes[1280 + 2 * i]} = INITVAL_28[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1312 + 2 * i + 1], bytes[1312 + 2 * i]} = INITVAL_29[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1344 + 2 * i + 1], bytes[1344 + 2 * i]} = INITVAL_2A[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1376 + 2 * i + 1], bytes[1376 + 2 * i]} = INITVAL_2B[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1408 + 2 * i + 1], bytes[1408 + 2 * i]} = INITVAL_2C[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1440 + 2 * i + 1], bytes[1440 + 2 * i]} = INITVAL_2D[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1472 + 2 * i + 1], bytes[1472 + 2 * i]} = INITVAL_2E[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1504 + 2 * i + 1], bytes[1504 + 2 * i]} = INITVAL_2F[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1536 + 2 * i + 1], bytes[1536 + 2 * i]} = INITVAL_30[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1568 + 2 * i + 1], bytes[1568 + 2 * i]} = INITVAL_31[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1600 + 2 * i + 1], bytes[1600 + 2 * i]} = INITVAL_32[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1632 + 2 * i + 1], bytes[1632 + 2 * i]} = INITVAL_33[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1664 + 2 * i + 1], bytes[1664 + 2 * i]} = INITVAL_34[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1696 + 2 * i + 1], bytes[1696 + 2 * i]} = INITVAL_35[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1728 + 2 * i + 1], bytes[1728 + 2 * i]} = INITVAL_36[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1760 + 2 * i + 1], bytes[1760 + 2 * i]} = INITVAL_37[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1792 + 2 * i + 1], bytes[1792 + 2 * i]} = INITVAL_38[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1824 + 2 * i + 1], bytes[1824 + 2 * i]} = INITVAL_39[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1856 + 2 * i + 1], bytes[1856 + 2 * i]} = INITVAL_3A[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1888 + 2 * i + 1], bytes[1888 + 2 * i]} = INITVAL_3B[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1920 + 2 * i + 1], bytes[1920 + 2 * i]} = INITVAL_3C[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1952 + 2 * i + 1], bytes[1952 + 2 * i]} = INITVAL_3D[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[1984 + 2 * i + 1], bytes[1984 + 2 * i]} = INITVAL_3E[20 * i +: 18];
    for (i = 0; i < 16; i = i + 1) {bytes[2016 + 2 * i + 1], bytes[2016 + 2 * i]} = INITVAL_3F[20 * i +: 18];
    for (i = 0; i < 4; i = i + 1) {read_a[9 * i +: 9], read_b[9 * i +: 9], held_a[9 * i +: 9], held_b[9 * i +: 9]} = 0;
    if (DATA_WIDTH_A < 9 || DATA_WIDTH_B < 9 || CLKAMUX != "CLKA" || CLKBMUX != "CLKB") begin
      $display("DP16KD: a mode that the model does not know");
      $finish(0);
    end
  end

  wire [13:0] address_a = {ADA13, ADA12, ADA11, ADA10, ADA9, ADA8, ADA7, ADA6, ADA5, ADA4, ADA3, ADA2, ADA1, ADA0};
  wire [17:0] in_a = {
    DIA17, DIA16, DIA15, DIA14, DIA13, DIA12, DIA11, DIA10, DIA9,
    DIA8, DIA7, DIA6, DIA5, DIA4, DIA3, DIA2, DIA1, DIA0
  };
  wire [13:0] address_b = {ADB13, ADB12, ADB11, ADB10, ADB9, ADB8, ADB7, ADB6, ADB5, ADB4, ADB3, ADB2, ADB1, ADB0};
  wire [17:0] in_b = {
    DIB17, DIB16, DIB15, DIB14, DIB13, DIB12, DIB11, DIB10, DIB9,
    DIB8, DIB7, DIB6, DIB5, DIB4, DIB3, DIB2, DIB1, DIB0
  };
  wire [35:0] word_a = {in_b, in_a};
  wire [35:0] word_b = {18'b0, in_b};
  reg [35:0] read_a, read_b, held_a, held_b;

  localparam LANES_A = DATA_WIDTH_A / 9;
  wire [10:0] first_a = address_a[13:3] & ~(LANES_A - 1);
  integer lane_a;
  always @(posedge CLKA) begin
    if (OCEA) held_a <= read_a;
    if (CEA)
      for (lane_a = 0; lane_a < LANES_A; lane_a = lane_a + 1) begin
        read_a[9 * lane_a +: 9] <= bytes[first_a + lane_a];
        if (WEA && (LANES_A == 1 || address_a[lane_a]))
          bytes[first_a + lane_a] <= word_a[9 * lane_a +: 9];
      end
  end
  wire [35:0] out_a = REGMODE_A == "OUTREG" ? held_a : read_a;

  localparam LANES_B = DATA_WIDTH_B / 9;
  wire [10:0] first_b = address_b[13:3] & ~(LANES_B - 1);
  integer lane_b;
  always @(posedge CLKB) begin
    if (OCEB) held_b <= read_b;
    if (CEB)
      for (lane_b = 0; lane_b < LANES_B; lane_b = lane_b + 1) begin
        read_b[9 * lane_b +: 9] <= bytes[first_b + lane_b];
        if (WEB && (LANES_B == 1 || address_b[lane_b]))
          bytes[first_b + lane_b] <= word_b[9 * lane_b +: 9];
      end
  end
  wire [35:0] out_b = REGMODE_B == "OUTREG" ? held_b : read_b;

  // A word of 36 bits read through port B leaves through both; a narrower one through its own.
  assign {
    DOA17, DOA16, DOA15, DOA14, DOA13, DOA12, DOA11, DOA10, DOA9,
    DOA8, DOA7, DOA6, DOA5, DOA4, DOA3, DOA2, DOA1, DOA0
  } = DATA_WIDTH_B == 36 ? out_b[17:0] : out_a[17:0];
  assign {
    DOB17, DOB16, DOB15, DOB14, DOB13, DOB12, DOB11, DOB10, DOB9,
    DOB8, DOB7, DOB6, DOB5, DOB4, DOB3, DOB2, DOB1, DOB0
  } = DATA_WIDTH_B == 36 ? out_b[35:18] : out_b[17:0];
endmodule

// Signed or unsigned factors, without registers.
module MULT18X18D (
  input
  A0, A1, A2, A3, A4, A5, A6, A7, A8,
  A9, A10, A11, A12, A13, A14, A15, A16, A17,
  input
  B0, B1, B2, B3, B4, B5, B6, B7, B8,
  B9, B10, B11, B12, B13, B14, B15, B16, B17,
  input
  C0, C1, C2, C3, C4, C5, C6, C7, C8,
  C9, C10, C11, C12, C13, C14, C15, C16, C17,
  input SIGNEDA, SIGNEDB, SOURCEA, SOURCEB,
  output
  P0, P1, P2, P3, P4, P5, P6, P7, P8,
  P9, P10, P11, P12, P13, P14, P15, P16, P17,
  P18, P19, P20, P21, P22, P23, P24, P25, P26,
  P27, P28, P29, P30, P31, P32, P33, P34, P35
);
  wire [17:0] a = {
    A17, A16, A15, A14, A13, A12, A11, A10, A9,
    A8, A7, A6, A5, A4, A3, A2, A1, A0
  };
  wire [17:0] b = {
    B17, B16, B15, B14, B13, B12, B11, B10, B9,
    B8, B7, B6, B5, B4, B3, B2, B1, B0
  };
  wire signed [18:0] wide_a = {SIGNEDA && a[17], a};
  wire signed [18:0] wide_b = {SIGNEDB && b[17], b};
  wire signed [37:0] product = wide_a * wide_b;
  assign {
    P35, P34, P33, P32, P31, P30, P29, P28, P27,
    P26, P25, P24, P23, P22, P21, P20, P19, P18,
    P17, P16, P15, P14, P13, P12, P11, P10, P9,
    P8, P7, P6, P5, P4, P3, P2, P1, P0
  } = product[35:0];
endmodule

// Driver of a pin that nextpnr makes of Yosys' cell.
module \$_TBUF_ (input A, E, output Y);
  assign Y = E ? A : 1'bz;
endmodule

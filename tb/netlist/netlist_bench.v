// SPDX-License-Identifier: Apache-2.0
// Plays the words of input.hex, one each pixel clock of PERIOD ps, into a board's netlist and writes those that come
// out, sampled in tenths behind each edge of the clock lane, into output.hex. A word: ten bits of each channel, bit 0 first.
`timescale 1ps / 1ps

module netlist_bench;
  parameter WORDS = 1;
  parameter PERIOD = 13470;

  reg [31:0] words [0:WORDS - 1];
  reg clk_25 = 0;
  reg in_clk = 0;
  reg [2:0] in_data = 0;
  reg [29:0] taken;
  integer i, j, c, k, file;

  wire out_clk, in_hot_plug, uart_tx, in_sda, out_scl, out_sda;
  wire [2:0] out_data;
  wire [7:0] led;
  pullup (in_sda);
  pullup (out_scl);
  pullup (out_sda);

  ulx3s_top board (
    .clk_25(clk_25), .reset_n(1'b1),
    .in_clk(in_clk), .in_data(in_data), .in_scl(1'b1), .in_sda(in_sda), .in_hot_plug(in_hot_plug),
    .out_clk(out_clk), .out_data(out_data), .out_scl(out_scl), .out_sda(out_sda),
    .uart_rx(1'b1), .uart_tx(uart_tx), .button_up(1'b0), .button_down(1'b0), .button_clear(1'b0),
    .switch_pattern(1'b0), .switch_pass(1'b0), .switch_sweep(1'b0), .led(led), .wifi_gpio0(1'b1), .wifi_gpio0_new(1'b1)
  );

  always #20000 clk_25 = ~clk_25;

  initial begin
    $readmemh("input.hex", words);
    file = $fopen("output.hex", "w");
    #1000000;
    for (i = 0; i < WORDS; i = i + 1)
      for (j = 0; j < 10; j = j + 1) begin
        in_clk = j < 5;
        for (c = 0; c < 3; c = c + 1) in_data[c] = words[i][10 * c + j];
        #(PERIOD / 10);
      end
    $display("LEDs %b", led);
    $fclose(file);
    $finish(0);
  end

  always @(posedge out_clk) begin
    #(PERIOD / 20);
    for (k = 0; k < 10; k = k + 1) begin
      taken[k] = out_data[0];
      taken[10 + k] = out_data[1];
      taken[20 + k] = out_data[2];
      if (k != 9) #(PERIOD / 10);
    end
    $fdisplay(file, "%h", taken);
  end
endmodule

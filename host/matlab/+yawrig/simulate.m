function [time_s, angle_deg, made] = simulate(varargin)
% SIMULATE  A record of the virtual rig whose truth is known.
%
%   [time_s, angle_deg] = yawrig.simulate('spring', 'K4', 'wind', 10)
%   [time_s, angle_deg, made] = yawrig.simulate('natural_frequency', 7, 'damping', 0.01, 'seed', 2)
%
% Options are the program's flags (`yawrig simulate --help`). MADE.truth says what was planted.
  file = [tempname(), '.csv'];
  made = yawrig.ask('simulate', {}, varargin{:}, 'out', file);
  clean = onCleanup(@() delete(file)); %#ok<NASGU>
  numbers = dlmread(file, ',', 1, 0);
  time_s = numbers(:, 1);
  angle_deg = numbers(:, 2);
end

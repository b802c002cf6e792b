function found = diagnose(varargin)
% DIAGNOSE  Which physical effect a second-order model of a release lacks.
%
%   found = yawrig.diagnose(time_s, angle_deg)
%   found = yawrig.diagnose({'a.csv', 'b.csv'}, 'same_rig', true)
%   found = yawrig.diagnose('campaign.toml')
%
% FOUND has the names of the program's JSON: status, effects, modal, steps, candidates and more.
  [files, options, clean] = yawrig.recorded(varargin); %#ok<ASGLU>
  found = yawrig.ask('diagnose', files, options{:});
end

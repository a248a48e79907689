(** The distribution function of the normal distribution, which GELU is made of, between integers over 2^256; where the
  derivative of GELU changes its sign. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Exponential Activations ErrorFunction Gauss Pi Algebra Form Network Checker Fixed.
Import ListNotations.
Open Scope Z_scope.

(** Of words of 64 bits, the first ones before. *)
Definition in_words (words : list Z) : Z := fold_left (fun n w => Z.shiftl n 64 + w) words 0.
(** 1 / sqrt (2 PI). *)
Definition inverse_rootF : fixed :=
  (in_words [7359186146747302452; 4552278581328099519; 15240919118843938520; 13855036653811554707],
   in_words [7359186146747302452; 4552278581328099519; 15240919118843938520; 13855126013160034035]).
(** Terms x^(2 k + 1) / (1 3 5 ... (2 k + 1)) and their sum, until a term vanishes or there are n; k = 2 n + 3 of the
  last one. *)
Fixpoint normal_series (n : nat) (k : Z) (square term sum : fixed) : Z * fixed * fixed :=
  match n with
  | O => (k, term, sum)
  | S n' =>
      if snd term <=? 1 then (k, term, sum)
      else let t := overF (mulF term square) k in normal_series n' (k + 2) square t (addF sum t)
  end.
Definition halfF : fixed := (Z.shiftl 1 255, Z.shiftl 1 255).
Definition densityF (x : fixed) : fixed :=
  let s := mulF x x in mulF (exp_of_minus (overF (greatest 0 (fst s), snd s) 2)) inverse_rootF.
Definition most_terms : nat := (20 * 30)%nat.
(** From x = 14 on it is above 1 - 2^-141. *)
Definition far : Z := 14 * unit_of_fixed.
Definition probability_of_positive (x : fixed) : fixed :=
  if far <=? fst x then (unit_of_fixed - Z.shiftl 1 115, unit_of_fixed)
  else
    let square := mulF x x in
    let '(k, term, sum) := normal_series most_terms 3 square x x in
    let p := addF halfF (mulF (densityF x) (fst sum, snd sum + snd term)) in
    (fst p, if 2 * snd square <=? (k - 2) * unit_of_fixed then least (snd p) unit_of_fixed else unit_of_fixed).
Definition probabilityF (t : dyadic) : fixed :=
  let p := probability_of_positive (of_dyadic (abs t)) in if is_nonnegative t then p else addF oneF (negF p).

Open Scope R_scope.
(** The density without its factor, its integral, and the sums of the series that it times. *)
Definition hat (x : R) : R := exp (- (x * x / 2)).
Definition hat_integral (x : R) : R := sqrt 2 * integral (x / sqrt 2).
Definition density (x : R) : R := hat x * / sqrt (2 * PI).
Definition probability (x : R) : R := / 2 + hat_integral x * / sqrt (2 * PI).
Fixpoint coefficient (n : nat) : R := match n with O => 1 | S m => coefficient m / INR (2 * m + 3) end.
Definition normal_term (n : nat) (x : R) : R := coefficient n * x ^ (2 * n + 1).
Fixpoint normal_sum (n : nat) (x : R) : R :=
  match n with O => normal_term 0 x | S m => normal_sum m x + normal_term n x end.

Lemma roots x : x / sqrt 2 * (x / sqrt 2) = x * x / 2.
Proof.
  pose proof sqrt_2_positive. pose proof (sqrt_sqrt 2 ltac:(lra)) as S.
  replace (x / sqrt 2 * (x / sqrt 2)) with (x * x / (sqrt 2 * sqrt 2)) by (field; lra). now rewrite S.
Qed.
Lemma hat_bell x : hat x = bell (x / sqrt 2). Proof. unfold hat, bell. now rewrite roots. Qed.
Lemma root_two_pi : sqrt (2 * PI) = sqrt 2 * sqrt PI.
Proof. pose proof pi_large. apply sqrt_mult_alt. lra. Qed.
Lemma gelu_probability x : act Gelu x = x * probability x.
Proof.
  cbn [act]. unfold probability, hat_integral. rewrite erf_integral, root_two_pi. pose proof sqrt_2_positive.
  pose proof root_pi_large. set (i := integral (x / sqrt 2)). clearbody i. field. lra.
Qed.
Lemma hat_integral_derivative x : derivable_pt_lim hat_integral x (hat x).
Proof.
  pose proof sqrt_2_positive as P. rewrite hat_bell.
  replace (bell (x / sqrt 2)) with (sqrt 2 * (bell (x / sqrt 2) * (1 * / sqrt 2))) by (field; lra).
  apply (derivable_pt_lim_scal (fun x => integral (x / sqrt 2))).
  apply (derivable_pt_lim_comp (fun x => x / sqrt 2) integral); [|apply integral_derivative].
  replace (1 * / sqrt 2) with (1 * / sqrt 2 + x * 0) by ring.
  apply (derivable_pt_lim_mult id (fun _ => / sqrt 2)); [apply derivable_pt_lim_id|apply derivable_pt_lim_const].
Qed.
Lemma hat_derivative x : derivable_pt_lim hat x (- (x * hat x)).
Proof.
  replace (- (x * hat x)) with (hat x * - ((1 * x + x * 1) * / 2)) by field.
  apply (derivable_pt_lim_comp (fun x => - (x * x / 2)) exp); [|apply derivable_pt_lim_exp].
  apply (derivable_pt_lim_opp (fun x => x * x / 2)).
  replace ((1 * x + x * 1) * / 2) with ((1 * x + x * 1) * / 2 + x * x * 0) by ring.
  apply (derivable_pt_lim_mult (fun x => x * x) (fun _ => / 2)); [|apply derivable_pt_lim_const].
  apply (derivable_pt_lim_mult id id); apply derivable_pt_lim_id.
Qed.
Lemma coefficient_positive n : 0 < coefficient n.
Proof.
  induction n as [|n IH]; simpl coefficient; [lra|]. apply Rdiv_lt_0_compat; auto. apply lt_0_INR. lia.
Qed.
Lemma term_derivative n x : derivable_pt_lim (normal_term n) x (coefficient n * (INR (2 * n + 1) * x ^ (2 * n))).
Proof.
  apply (derivable_pt_lim_scal (fun x => x ^ (2 * n + 1))). pose proof (derivable_pt_lim_pow x (2 * n + 1)) as D.
  replace (Init.Nat.pred (2 * n + 1)) with (2 * n)%nat in D by lia. exact D.
Qed.
Lemma next_derivative n x : coefficient (S n) * (INR (2 * S n + 1) * x ^ (2 * S n)) = x * normal_term n x.
Proof.
  unfold normal_term. cbn [coefficient]. replace (2 * S n + 1)%nat with (2 * n + 3)%nat by lia.
  replace (2 * S n)%nat with (S (2 * n + 1)) by lia. rewrite <- tech_pow_Rmult.
  pose proof (not_0_INR (2 * n + 3) ltac:(lia)). field. auto.
Qed.
Lemma sum_derivative n x : derivable_pt_lim (normal_sum n) x (1 + x * (normal_sum n x - normal_term n x)).
Proof.
  induction n as [|n IH]; cbn [normal_sum].
  - pose proof (term_derivative 0 x) as D.
    replace (coefficient 0 * _) with (1 + x * (normal_term 0 x - normal_term 0 x)) in D
      by (simpl; ring). exact D.
  - replace (1 + x * (normal_sum n x + normal_term (S n) x - normal_term (S n) x)) with
      (1 + x * (normal_sum n x - normal_term n x) + coefficient (S n) * (INR (2 * S n + 1) * x ^ (2 * S n)))
      by (rewrite next_derivative; ring).
    apply (derivable_pt_lim_plus (normal_sum n) (normal_term (S n))); [exact IH|apply term_derivative].
Qed.
Lemma normal_term_nonneg n x : 0 <= x -> 0 <= normal_term n x.
Proof. intros H. pose proof (coefficient_positive n). apply Rmult_le_pos; [lra|now apply pow_le]. Qed.
Lemma hat_positive x : 0 < hat x. Proof. apply exp_pos. Qed.
Lemma at_zero n : normal_sum n 0 = 0 /\ hat_integral 0 = 0.
Proof.
  split; [|unfold hat_integral; unfold Rdiv; rewrite Rmult_0_l, integral_at_0; ring].
  assert (forall k, normal_term k 0 = 0) as T by (intros k; unfold normal_term; rewrite pow_ne_zero by lia; ring).
  induction n as [|n IH]; cbn [normal_sum]; rewrite ?T, ?IH; ring.
Qed.
Lemma integral_above_sum n x : 0 <= x -> hat x * normal_sum n x <= hat_integral x.
Proof.
  intros X. destruct (at_zero n) as [Z Z']. enough (0 * (x - 0) <= (hat_integral x - hat x * normal_sum n x) -
    (hat_integral 0 - hat 0 * normal_sum n 0)) by (rewrite Z, Z' in H; lra).
  apply (at_least_the_derivative (fun x => hat_integral x - hat x * normal_sum n x)
    (fun x => hat x - (- (x * hat x) * normal_sum n x + hat x * (1 + x * (normal_sum n x - normal_term n x))))); auto.
  intros c Hc. split.
  - apply (derivable_pt_lim_minus hat_integral (fun x => hat x * normal_sum n x)); [apply hat_integral_derivative|].
    apply (derivable_pt_lim_mult hat (normal_sum n)); [apply hat_derivative|apply sum_derivative].
  - pose proof (hat_positive c). pose proof (normal_term_nonneg n c ltac:(lra)).
    replace (hat c - _) with (hat c * (c * normal_term n c)) by ring.
    apply Rmult_le_pos; [lra|]. apply Rmult_le_pos; lra.
Qed.
Lemma integral_below_sum n x : 0 <= x -> 2 * (x * x) <= INR (2 * n + 1) ->
  hat_integral x <= hat x * (normal_sum n x + normal_term n x).
Proof.
  intros X Small. destruct (at_zero n) as [Z Z'].
  assert (normal_term n 0 = 0) as T by (unfold normal_term; rewrite pow_ne_zero by lia; ring).
  enough (0 * (x - 0) <= (hat x * (normal_sum n x + normal_term n x) - hat_integral x) -
    (hat 0 * (normal_sum n 0 + normal_term n 0) - hat_integral 0)) by (rewrite Z, Z', T in H; lra).
  set (d x := - (x * hat x) * (normal_sum n x + normal_term n x) +
    hat x * (1 + x * (normal_sum n x - normal_term n x) + coefficient n * (INR (2 * n + 1) * x ^ (2 * n)))).
  apply (at_least_the_derivative (fun x => hat x * (normal_sum n x + normal_term n x) - hat_integral x)
    (fun x => d x - hat x)); auto. intros c Hc. split.
  - apply (derivable_pt_lim_minus (fun x => hat x * (normal_sum n x + normal_term n x)) hat_integral);
      [|apply hat_integral_derivative].
    apply (derivable_pt_lim_mult hat (fun x => normal_sum n x + normal_term n x)); [apply hat_derivative|].
    apply (derivable_pt_lim_plus (normal_sum n) (normal_term n)); [apply sum_derivative|apply term_derivative].
  - pose proof (hat_positive c). pose proof (coefficient_positive n). set (e := c ^ (2 * n)).
    assert (0 <= e) by (apply pow_le; lra). assert (normal_term n c = coefficient n * (c * e)) as E.
    { unfold normal_term, e. rewrite pow_add, pow_1. ring. }
    replace (d c - hat c) with (hat c * (coefficient n * (e * (INR (2 * n + 1) - 2 * (c * c)))))
      by (unfold d; rewrite E; fold e; ring).
    assert (c * c <= x * x) by nra. apply Rmult_le_pos; [lra|]. apply Rmult_le_pos; [lra|]. apply Rmult_le_pos; lra.
Qed.

(** The limit. *)
Lemma erf_part x : hat_integral x * / sqrt (2 * PI) = integral (x / sqrt 2) / sqrt PI.
Proof.
  unfold hat_integral. rewrite root_two_pi. pose proof sqrt_2_positive. pose proof root_pi_large.
  set (i := integral _). field. lra.
Qed.
Lemma probability_between x : 0 <= x -> / 2 <= probability x <= 1 /\ 1 - hat x * (2 / PI) <= probability x.
Proof.
  intros X. unfold probability. rewrite erf_part. pose proof sqrt_2_positive as R. pose proof root_pi_large as Q.
  pose proof pi_large as P. set (u := x / sqrt 2). assert (0 <= u) as Hu
    by (apply Rmult_le_pos; [auto|left; now apply Rinv_0_lt_compat]).
  pose proof (integral_nonneg u Hu) as N. destruct (integral_square u Hu) as [L H]. rewrite hat_bell. fold u.
  pose proof (sqrt_sqrt PI ltac:(lra)) as S. set (i := integral u) in *. set (z := i / sqrt PI).
  assert (z * sqrt PI = i) as E by (unfold z; field; lra). assert (z * z * PI = i * i) as E2.
  { rewrite <- E. replace (z * sqrt PI * (z * sqrt PI)) with (z * z * (sqrt PI * sqrt PI)) by ring. now rewrite S. }
  assert (0 <= z) by (apply Rmult_le_pos; [auto|left; apply Rinv_0_lt_compat; lra]).
  assert (z <= / 2).
  { destruct (Rle_lt_dec z (/ 2)) as [|G]; auto. assert (/ 2 * / 2 < z * z) by nra. nra. }
  split; [lra|]. set (w := bell u / PI). assert (w * PI = bell u) as W by (unfold w; field; lra).
  replace (bell u * (2 / PI)) with (2 * w) by (unfold w; field; lra).
  assert (/ 4 - w <= z * z) by (apply (Rmult_le_reg_r PI); lra). nra.
Qed.
Lemma hat_far x : 14 <= x -> hat x * (2 / PI) <= / 2 ^ 141.
Proof.
  intros X. assert (2 <= exp (98 / 141)) as H.
  { replace (98 / 141) with (2 * (2 * (2 * (2 * (98 / 2256))))) by field.
    apply exp_double with (a := 141529 / 100000); [lra| |lra].
    apply exp_double with (a := 118966 / 100000); [lra| |lra].
    apply exp_double with (a := 109072 / 100000); [lra| |lra].
    apply exp_double with (a := 104438 / 100000); [lra| |lra].
    pose proof (exp_square (98 / 2256)). lra. }
  assert (2 ^ 141 <= exp 98) as G.
  { replace 98 with (INR 141 * (98 / 141)) by (rewrite INR_IZR_INZ; simpl; field). rewrite <- exp_multiple.
    apply pow_incr. lra. }
  assert (hat x <= exp (- (98))) as F by (apply exp_rises; nra). pose proof (exp_opp 98) as O. pose proof pi_large.
  assert (0 < 2 / PI <= 1) as K.
  { split; [apply Rdiv_lt_0_compat; lra|]. apply (Rmult_le_reg_r PI); [lra|]. unfold Rdiv.
    rewrite Rmult_assoc, Rinv_l; lra. }
  pose proof (hat_positive x). pose proof (exp_pos (- (98))). assert (0 < 2 ^ 141) as T by (apply pow_lt; lra).
  apply Rle_trans with (exp (- (98))); [nra|]. apply (Rmult_le_reg_l (2 ^ 141)); auto. rewrite Rinv_r by lra. nra.
Qed.

(** In integers *)
Lemma inside_inverse_root : inside inverse_rootF (/ sqrt (2 * PI)).
Proof.
  destruct pi_between as [L H]. pose proof pi_large as P. assert (0 < sqrt (2 * PI)) as S by (apply sqrt_lt_R0; lra).
  pose proof (sqrt_sqrt (2 * PI) ltac:(lra)) as Q. set (s := sqrt (2 * PI)) in *.
  assert (0 < IZR (Z.shiftl 1 208)) as D by (apply (IZR_lt 0); vm_compute; reflexivity).
  assert (IZR (fst inverse_rootF * fst inverse_rootF * (2 * pi_high)) <=
    IZR (unit_of_fixed * unit_of_fixed * Z.shiftl 1 208)) as Low
    by (apply IZR_le, Z.leb_le; vm_compute; reflexivity).
  assert (IZR (unit_of_fixed * unit_of_fixed * Z.shiftl 1 208) <=
    IZR (snd inverse_rootF * snd inverse_rootF * (2 * pi_low))) as High
    by (apply IZR_le, Z.leb_le; vm_compute; reflexivity).
  assert (0 < IZR (fst inverse_rootF)) as PL by (apply (IZR_lt 0); vm_compute; reflexivity).
  assert (0 < IZR (snd inverse_rootF)) as PH by (apply (IZR_lt 0); vm_compute; reflexivity).
  rewrite !mult_IZR, U_integer in Low, High. pose proof U_positive as PU. unfold inside.
  set (d := IZR (Z.shiftl 1 208)) in *. set (a := IZR pi_low) in *. set (b := IZR pi_high) in *.
  set (l := IZR (fst inverse_rootF)) in *. set (h := IZR (snd inverse_rootF)) in *. clearbody d a b l h s.
  assert (l * s * (l * s) <= U * U) as A.
  { apply (Rmult_le_reg_r d); auto. replace (l * s * (l * s) * d) with (l * l * (s * s * d)) by ring. rewrite Q.
    apply Rle_trans with (2 := Low). replace (2 * PI * d) with (2 * (PI * d)) by ring. apply Rmult_le_compat_l; nra. }
  assert (U * U <= h * s * (h * s)) as B.
  { apply (Rmult_le_reg_r d); auto. replace (h * s * (h * s) * d) with (h * h * (s * s * d)) by ring. rewrite Q.
    apply Rle_trans with (1 := High). replace (2 * PI * d) with (2 * (PI * d)) by ring. apply Rmult_le_compat_l; nra. }
  assert (l * s <= U) as A' by (destruct (Rle_lt_dec (l * s) U); auto; nra).
  assert (U <= h * s) as B'
    by (destruct (Rle_lt_dec U (h * s)); auto; assert (0 < h * s) by (now apply Rmult_lt_0_compat); nra).
  assert (/ s * U * s = U) as E by (field; lra). split; apply (Rmult_le_reg_r s); lra.
Qed.
Lemma inside_density x a : inside x a -> inside (densityF x) (density a).
Proof.
  intros I. unfold densityF, density. apply inside_mul; [|apply inside_inverse_root].
  pose proof (inside_mul x x a a I I) as [S1 S2]. pose proof (Rle_0_sqr a) as P. unfold Rsqr in P.
  apply inside_exp; [|lra]. apply (inside_over _ 2); [lia|]. split; [|exact S2].
  cbn [fst]. unfold greatest. destruct (Z.leb_spec 0 (fst (mulF x x))); [exact S1|]. pose proof U_positive. nra.
Qed.
Lemma term_step n x : normal_term (S n) x = normal_term n x * (x * x) / IZR (Z.of_nat (2 * n + 3)).
Proof.
  rewrite <- INR_IZR_INZ. unfold normal_term. cbn [coefficient].
  replace (2 * S n + 1)%nat with (S (S (2 * n + 1))) by lia.
  rewrite <- !tech_pow_Rmult. pose proof (not_0_INR (2 * n + 3) ltac:(lia)). field. auto.
Qed.
Lemma inside_normal_series n square x : inside square (x * x) -> forall m term sum,
  inside term (normal_term m x) -> inside sum (normal_sum m x) ->
  let '(k, t, s) := normal_series n (Z.of_nat (2 * m + 3)) square term sum in
  exists l, k = Z.of_nat (2 * l + 3) /\ inside t (normal_term l x) /\ inside s (normal_sum l x).
Proof.
  intros Hs. induction n as [|n IH]; intros m term sum T Q; cbn [normal_series]; [now exists m|].
  destruct (snd term <=? 1)%Z; [now exists m|].
  replace (Z.of_nat (2 * m + 3) + 2)%Z with (Z.of_nat (2 * S m + 3)) by lia.
  assert (inside (overF (mulF term square) (Z.of_nat (2 * m + 3))) (normal_term (S m) x)) as T'.
  { rewrite term_step. apply inside_over; [lia|]. now apply inside_mul. }
  apply IH; auto. cbn [normal_sum]. now apply inside_add.
Qed.
Lemma half_of_unit : IZR (Z.shiftl 1 255) = / 2 * U.
Proof.
  rewrite <- U_integer. replace unit_of_fixed with (2 * Z.shiftl 1 255)%Z by (vm_compute; reflexivity).
  rewrite mult_IZR. lra.
Qed.
Lemma far_unit : IZR (unit_of_fixed - Z.shiftl 1 115) = (1 - / 2 ^ 141) * U.
Proof.
  rewrite minus_IZR, U_integer. replace (IZR (Z.shiftl 1 115)) with (/ 2 ^ 141 * U); [ring|].
  rewrite <- U_integer. replace unit_of_fixed with (2 ^ Z.of_nat 141 * Z.shiftl 1 115)%Z by (vm_compute; reflexivity).
  rewrite mult_IZR, <- pow_IZR, <- Rmult_assoc, Rinv_l, Rmult_1_l; auto. apply pow_nonzero. lra.
Qed.
#[local] Opaque normal_series densityF.
Lemma inside_probability_of_positive x a : inside x a -> 0 <= a -> inside (probability_of_positive x) (probability a).
Proof.
  intros I A. unfold probability_of_positive. pose proof U_positive as P.
  destruct (probability_between a A) as [[B C] F].
  destruct (Z.leb_spec far (fst x)) as [G|_].
  - assert (14 <= a) as G'.
    { apply IZR_le in G. unfold far in G. rewrite mult_IZR, U_integer in G. destruct I as [I _].
      apply (Rmult_le_reg_r U); lra. }
    pose proof (hat_far a G'). unfold inside. cbn [fst snd]. rewrite far_unit, U_integer. split; [|nra].
    apply Rmult_le_compat_r; lra.
  - pose proof (inside_mul x x a a I I) as S.
    assert (inside x (normal_term 0 a)) as T0 by (unfold normal_term; simpl; rewrite !Rmult_1_l, Rmult_1_r; exact I).
    pose proof (inside_normal_series most_terms (mulF x x) a S 0 x x T0 T0) as N.
    change (Z.of_nat (2 * 0 + 3)) with 3%Z in N. destruct (normal_series most_terms 3 (mulF x x) x x) as [[k t] s].
    destruct N as (l & K & [T1 T2] & [S1 S2]). pose proof (normal_term_nonneg l a A) as Nt.
    assert (0 <= normal_term l a * U) by (apply Rmult_le_pos; lra). pose proof (hat_positive a) as Hp.
    assert (forall y, normal_sum l a <= y <= normal_sum l a + normal_term l a ->
      inside (addF halfF (mulF (densityF x) (fst s, snd s + snd t)%Z)) (/ 2 + density a * y)) as Y.
    { intros y Hy. apply inside_add; [unfold inside, halfF; cbn [fst snd]; rewrite half_of_unit; lra|].
      apply inside_mul; [now apply inside_density|]. unfold inside. cbn [fst snd]. rewrite plus_IZR.
      assert (normal_sum l a * U <= y * U <= (normal_sum l a + normal_term l a) * U) by (split; apply Rmult_le_compat_r;
        lra). lra. }
    set (p := addF halfF _) in *. clearbody p. destruct (Y (normal_sum l a) ltac:(lra)) as [Y1 _].
    destruct (Y (normal_sum l a + normal_term l a) ltac:(lra)) as [_ Y2].
    assert (0 < / sqrt (2 * PI)) as R
      by (apply Rinv_0_lt_compat, sqrt_lt_R0; pose proof pi_large; lra).
    unfold inside. cbn [fst snd]. split.
    + apply Rle_trans with (1 := Y1). apply Rmult_le_compat_r; [lra|]. unfold probability, density.
      pose proof (integral_above_sum l a A). apply Rplus_le_compat_l. nra.
    + assert (probability a * U <= IZR unit_of_fixed) as One by (rewrite U_integer; nra).
      destruct (Z.leb_spec (2 * snd (mulF x x)) ((k - 2) * unit_of_fixed)) as [Q|_]; [|exact One].
      unfold least. destruct (snd p <=? unit_of_fixed)%Z; [|exact One]. apply Rle_trans with (2 := Y2).
      apply Rmult_le_compat_r; [lra|]. unfold probability, density. apply Rplus_le_compat_l.
      enough (hat_integral a <= hat a * (normal_sum l a + normal_term l a)) by nra.
      apply integral_below_sum; auto. apply IZR_le in Q. rewrite !mult_IZR, U_integer in Q. destruct S as [_ S].
      replace (k - 2)%Z with (Z.of_nat (2 * l + 1)) in Q by lia. rewrite <- INR_IZR_INZ in Q.
      apply (Rmult_le_reg_r U); lra.
Qed.
Lemma probability_odd x : probability (- x) = 1 - probability x.
Proof.
  unfold probability, hat_integral. replace (- x / sqrt 2) with (- (x / sqrt 2))
    by (unfold Rdiv; rewrite Ropp_mult_distr_l; reflexivity). rewrite integral_odd. field.
  apply Rgt_not_eq, sqrt_lt_R0. pose proof pi_large. lra.
Qed.
Lemma inside_normal t : inside (probabilityF t) (probability (real t)).
Proof.
  pose proof (inside_probability_of_positive _ _ (inside_dyadic (abs t))) as I. rewrite real_abs in I.
  specialize (I (Rabs_pos _)). unfold probabilityF. destruct (is_nonnegative t) eqn:N.
  - apply real_nonnegative in N. now rewrite Rabs_pos_eq in I.
  - assert (real t <= 0) as L.
    { destruct (Rle_lt_dec (real t) 0); auto. exfalso. unfold is_nonnegative, real in *. apply Z.leb_gt in N.
      apply IZR_lt in N. pose proof (power_pos (snd t)). nra. }
    rewrite Rabs_left1 in I by auto. replace (probability (real t)) with (1 + - probability (- real t))
      by (rewrite probability_odd; ring).
    apply inside_add; [apply inside_one|now apply inside_neg].
Qed.
Lemma density_even x : density (- x) = density x.
Proof. unfold density, hat. now rewrite Rmult_opp_opp. Qed.
Lemma inside_density_size t : inside (densityF (of_dyadic (abs t))) (density (real t)).
Proof.
  pose proof (inside_density _ _ (inside_dyadic (abs t))) as I. rewrite real_abs in I.
  unfold Rabs in I. destruct (Rcase_abs (real t)); [now rewrite density_even in I|exact I].
Qed.

(** The derivative of GELU. *)
Definition gelu_derivative_at (x : R) : R := gelu_slope (x / sqrt 2).
Lemma gelu_derivative_sum x : gelu_derivative_at x = probability x + x * density x.
Proof.
  unfold gelu_derivative_at, gelu_slope, probability, density. rewrite erf_part, hat_bell, root_two_pi.
  pose proof sqrt_2_positive. pose proof root_pi_large. set (i := integral _). set (b := bell _). field. lra.
Qed.
Lemma over_root_2 x : x / sqrt 2 * sqrt 2 = x.
Proof. pose proof sqrt_2_positive. field. lra. Qed.
Lemma gelu_derivative_holds x : derivable_pt_lim (act Gelu) x (gelu_derivative_at x).
Proof.
  pose proof sqrt_2_positive as P. intros e He.
  assert (derivable_pt_lim (fun x => sqrt 2 * gelu_scaled (x / sqrt 2)) x (gelu_derivative_at x)) as D.
  { unfold gelu_derivative_at. replace (gelu_slope (x / sqrt 2)) with
      (sqrt 2 * (gelu_slope (x / sqrt 2) * (1 * / sqrt 2 + x * 0))) by (field; lra).
    apply (derivable_pt_lim_scal (fun x => gelu_scaled (x / sqrt 2))).
    apply (derivable_pt_lim_comp (fun x => x / sqrt 2) gelu_scaled); [|apply gelu_derivative].
    apply (derivable_pt_lim_mult id (fun _ => / sqrt 2)); [apply derivable_pt_lim_id|apply derivable_pt_lim_const]. }
  destruct (D e He) as [d H]. exists d. intros h H1 H2. rewrite !gelu_at. now apply H.
Qed.
(** Its derivative: - weight (x^2 / 2 - 1). *)
Definition gelu_bend (x : R) : R := x * x / 2 - 1.
Definition gelu_weight (x : R) : R := / sqrt 2 * (/ sqrt PI * (2 * bell (x / sqrt 2))).
Lemma gelu_weight_positive x : 0 <= gelu_weight x.
Proof.
  pose proof sqrt_2_positive as A. pose proof root_pi_large. assert (0 < sqrt PI) as B by lra.
  apply Rinv_0_lt_compat in A, B. pose proof (bell_positive (x / sqrt 2)). unfold gelu_weight.
  apply Rmult_le_pos; [lra|]. apply Rmult_le_pos; lra.
Qed.
Lemma gelu_second_derivative x : derivable_pt_lim gelu_derivative_at x (- (gelu_weight x * gelu_bend x)).
Proof.
  pose proof sqrt_2_positive as P. replace (- (gelu_weight x * gelu_bend x)) with
    (gelu_curvature (x / sqrt 2) * (1 * / sqrt 2 + x * 0))
    by (unfold gelu_curvature, gelu_weight, gelu_bend; rewrite roots; ring).
  apply (derivable_pt_lim_comp (fun x => x / sqrt 2) gelu_slope); [|apply gelu_slope_derivative].
  apply (derivable_pt_lim_mult id (fun _ => / sqrt 2)); [apply derivable_pt_lim_id|apply derivable_pt_lim_const].
Qed.
Lemma gelu_bend_rises x y : Rabs x <= Rabs y -> gelu_bend x <= gelu_bend y.
Proof.
  intros H. unfold gelu_bend. pose proof (Rsqr_le_abs_1 x y H). unfold Rsqr in *. lra.
Qed.
Lemma gelu_derivative_opposite x : gelu_derivative_at (- x) = 1 - gelu_derivative_at x.
Proof.
  unfold gelu_derivative_at. rewrite <- gelu_slope_left. f_equal. unfold Rdiv. now rewrite Ropp_mult_distr_l.
Qed.
(** From 1 on it is above 1, since what is left of the integral is below u bell u. *)
Lemma gelu_slope_above_1 u : 1 <= u -> 1 < gelu_slope u.
Proof.
  intros H. pose proof root_pi_large as R. pose proof pi_large as P. pose proof (sqrt_sqrt PI ltac:(lra)) as S.
  destruct (integral_square u ltac:(lra)) as [L _]. set (r := sqrt PI) in *. pose proof (bell_positive u) as B.
  assert (/ 4 <= bell 1) as E.
  { pose proof (exp_above_line (- / 2)) as A. unfold bell. replace (- (1 * 1)) with (- / 2 + - / 2) by field.
    rewrite exp_plus. nra. }
  assert (/ 4 <= integral u) as I.
  { pose proof (integral_above 0 1 (bell 1) ltac:(lra) (fun c Hc => bell_falls c 1 Hc)) as I1.
    pose proof (integral_above 1 u 0 H (fun c _ => Rlt_le _ _ (bell_positive c))). rewrite integral_at_0 in I1. lra. }
  set (i := integral u) in *. set (b := bell u) in *. assert (r / 2 < i + u * b) as M.
  { destruct (Rlt_le_dec (r / 2) (i + u * b)) as [|G]; auto. exfalso.
    assert (i * i <= (r / 2 - u * b) * (r / 2 - u * b)) as Q by (apply Rmult_le_compat; lra).
    assert (b * (r * u) <= b * (1 + u * (u * b))) as T by nra. apply Rmult_le_reg_l in T; auto.
    assert (u * (u * b) <= u * (r / 2 - i)) by (apply Rmult_le_compat_l; lra). nra. }
  assert (gelu_slope u = / 2 + / r * (i + u * b)) as ->
    by (unfold gelu_slope; fold r; fold i; fold b; unfold Rdiv; field; lra).
  assert (/ r * (r / 2) = / 2) as K by (field; lra). assert (0 < / r) by (apply Rinv_0_lt_compat; lra). nra.
Qed.
Lemma gelu_slope_rises u v : -1 <= u -> u <= v -> v <= 1 -> gelu_slope u <= gelu_slope v.
Proof.
  intros A L B. enough (0 * (v - u) <= gelu_slope v - gelu_slope u) by lra.
  apply (at_least_the_derivative _ gelu_curvature _ _ _ L). intros c Hc. split; [apply gelu_slope_derivative|].
  pose proof (bell_positive c). assert (0 <= 1 - c * c) by nra. pose proof root_pi_large.
  assert (0 < / sqrt PI) by (apply Rinv_0_lt_compat; lra). unfold gelu_curvature.
  apply Rmult_le_pos; [lra|]. assert (0 <= bell c * (1 - c * c)) by (apply Rmult_le_pos; lra). lra.
Qed.
Lemma gelu_slope_negative u : u <= -1 -> gelu_slope u < 0.
Proof.
  intros H. pose proof (gelu_slope_above_1 (- u) ltac:(lra)) as G. rewrite gelu_slope_left in G. lra.
Qed.
(** It changes its sign once. *)
Lemma gelu_derivative_sign x y : x <= y -> (gelu_derivative_at y <= 0 -> gelu_derivative_at x <= 0) /\
  (0 <= gelu_derivative_at x -> 0 <= gelu_derivative_at y).
Proof.
  unfold gelu_derivative_at. intros L. pose proof sqrt_2_positive as P. apply Rinv_0_lt_compat in P.
  assert (x / sqrt 2 <= y / sqrt 2) as Q by (unfold Rdiv; apply Rmult_le_compat_r; lra).
  set (u := x / sqrt 2) in *. set (v := y / sqrt 2) in *.
  destruct (Rle_lt_dec 0 v) as [V|V].
  - pose proof (gelu_slope_right v V). split; intros; lra.
  - destruct (Rle_lt_dec u (-1)) as [W|W]; [pose proof (gelu_slope_negative u W); split; intros; lra|].
    pose proof (gelu_slope_rises u v ltac:(lra) Q ltac:(lra)). split; intros; lra.
Qed.
